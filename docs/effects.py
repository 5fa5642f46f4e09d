"""Make docs/effects.md, and the table of ids in docs/formats.md, from the registry: `./run python docs/effects.py`.

`--text` leaves the pictures as they are.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs.terminal import depth_span, turbo
from depthsim.scenefile import load_scene
from depthsim.sensor import Effect, Sensor, Stage, effect_class, effect_ids, learned_of, parameters_of
from depthsim.sensor.motion import Motion
from depthsim.trajectory import load_trajectory

OUT = Path(__file__).resolve().parent
PICTURES = OUT / "pictures" / "effects"
SIZE = (424, 240)
MOMENT = 0.35
WARM = 3600.0
"""[s] What acts with time is shown so long after the first frame."""
STAGES = {
    Stage.POSE: "the poses that the frame is cast from",
    Stage.OPTICS: "the directions of the rays",
    Stage.DISPARITY: "systematic errors of the disparity",
    Stage.NOISE: "random errors of disparity or depth",
    Stage.MIXING: "depths that come from a neighbour's surface, and the steps of the chip",
    Stage.HOLES: "pixels that become holes",
    Stage.PROCESSING: "what is done to the finished picture",
}
_KINDS = {"missing": "holes"}
"""How the page names a kind of gap, where diagnosis.json has another name for it."""
BEGIN, END = "<!-- effects -->", "<!-- end -->"
"""Around the table of ids in docs/formats.md."""
BAR = r"\|"
HEAD = """# The effects

Made by `docs/effects.py` from the code; do not edit. An effect stands in a sensor profile as `- id`, with its default
values, or as `- id: {parameter: value}`. Effects act in the order of this page, whatever their order in the file.
One of your own is a class in a file that the variable `DEPTHSIM_EFFECTS` names, as in [own_effect.md](own_effect.md).
With a parameter at its neutral value an effect changes not one bit (where several are marked *, all of them together).

Each picture shows one effect alone on a frame of the office, 424x240. On the left is the measured depth, near is blue;
on the right the error of the disparity, red where it is too large (too near) and blue where it is too small, in full
colour from the figure in its corner on. Black is a hole.
"""


def page() -> str:
    """The text of docs/effects.md."""
    parts, stage = [HEAD], None
    for effect_id in effect_ids():
        kind = effect_class(effect_id)
        if kind.stage != stage:
            stage = kind.stage
            parts.append(f"## {stage.name.capitalize()}: {STAGES[stage]}\n")
        parts.append(entry(kind))
    return "\n".join(parts)


def entry(kind: type[Effect]) -> str:
    """What the page says of one effect."""
    shown = kind.shown
    what = f"{kind.id}, " + (", ".join(f"{k} = {v:g}" for k, v in shown.items()) or "default values")
    text = [
        f"### {kind.id}\n",
        " ".join((kind.__doc__ or "").split()) + "\n",
        f"![{what}](pictures/effects/{kind.id}.png)\n",
    ]
    if shown or kind.seen_on:
        text.append(f"Shown: {what}{f', on {both(kind.seen_on)}' if kind.seen_on else ''}.\n")
    rows = [
        "| parameter | default | from | to | neutral | unit | what | source |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, one in parameters_of(kind).items():
        neutral = number(one.neutral)
        alone = neutral and not kind.model_validate({name: one.neutral}).is_neutral
        low, high = ("", "") if one.by_material else (number(one.low), number(one.high))
        cells = [f"`{name}`", number(one.default), low, high, neutral + ("*" if alone else ""), one.unit]
        rows.append("| " + " | ".join([*cells, one.about, one.source]) + " |")
    tables = [
        f"\n`{name}`, a table that is learned from a recording: {about}." for name, about in learned_of(kind).items()
    ]
    along = both([axis.replace("_", " ") for axis in kind.axes]) if kind.axes else "no axis, alike everywhere"
    kinds = both([_KINDS.get(one, one) for one in kind.kinds])
    text.append(f"Makes a gap of {kinds} along {along}. What to record to distinguish it: {kind.recording}.\n")
    return "\n".join([*text, *rows, *tables, "", f"Source: {kind.source}.\n"])


def formats(text: str) -> str:
    """The text of docs/formats.md with the table of ids as it is now."""
    rows = ["| id | what it is |", "| --- | --- |"]
    for effect_id in effect_ids():
        about = " ".join((effect_class(effect_id).__doc__ or "").split()).partition(". ")[0].rstrip(".")
        rows.append(f"| [{effect_id}](effects.md#{effect_id}) | {about.replace('|', BAR).replace('``', '`')} |")
    head, tail = text.split(BEGIN, maxsplit=1)[0], text.split(END)[1]
    return f"{head}{BEGIN}\n{chr(10).join(rows)}\n{END}{tail}"


def both(words: Sequence[str]) -> str:
    """Words in a row."""
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]]))


def number(value: Any) -> str:
    """A value of the table; nothing for None."""
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, int | float) else f"`{value}`"


class Studio:
    """Takes the pictures: the office, from a camera on its path."""

    def __init__(self) -> None:
        self.scene, self.camera = load_scene("office"), preset("d435", *SIZE)
        path = load_trajectory(None, self.scene, self.camera.rate)
        self.index = int(MOMENT * (len(path) - 1))
        self.stamp, self.pose = float(path.stamps[self.index]), path.matrices()[self.index]
        self.caster, self.motion = Caster(self.scene), Motion.along(path)

    def picture(self, kind: type[Effect]) -> NDArray[np.uint8]:
        """(240, 848, 3): depth and error side by side; of what acts from frame to frame the errors of two."""
        effects = [*(effect_class(other)() for other in kind.seen_on), kind(**kind.shown)]
        first, depth = self.error(effects, 0)
        if "frame_neighbours" in kind.axes[:1]:
            return np.concatenate([first, self.error(effects, 1)[0]], axis=1)
        return np.concatenate([depth, first], axis=1)

    def error(self, effects: list[Effect], later: int) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The pictures of error and depth, ``later`` frames on."""
        keys: dict[str, Any] = {"index": self.index + later, "stamp": self.stamp, "motion": self.motion}
        if "time" in effects[-1].axes[:1]:
            keys |= {"stamp": WARM, "motion": Motion.still(self.pose)}
        measured = Sensor(self.caster, self.camera, effects).measure(self.pose, **keys)
        z, clean = measured.depth.astype(float), measured.clean.depth.astype(float)
        near, far = depth_span(measured.clean.depth)
        share = np.log(np.clip(z, near, far) / near) / np.log(far / near)
        depth = np.where((z > 0)[..., None], turbo((np.round(63 * share) / 63).astype(np.float32)), 0).astype(np.uint8)
        fb, both = measured.camera.focal_baseline, (z > 0) & (clean > 0)
        error = np.where(both, fb / np.maximum(z, 1e-9) - fb / np.maximum(clean, 1e-9), 0)
        off = np.abs(error[both & (np.abs(error) > 1e-3)])
        most = max(float(np.percentile(off, 90)) if off.size else 0.0, 0.01)
        # Few tones, so that a palette holds them all.
        tone = np.round(20 * np.clip(error / most, -1, 1))[..., None] / 20
        ends = np.where(tone > 0, np.array([178, 24, 43]), np.array([33, 102, 172]))
        colour = 245 + (ends - 245) * np.abs(tone)
        picture = Image.fromarray(np.where((z > 0)[..., None], colour, 0).astype(np.uint8)).resize(SIZE, 0)
        if off.size:
            caption = f"{float(f'{most:.2g}'):g} px"
            ImageDraw.Draw(picture).text((4, SIZE[1] - 16), caption, fill="black", stroke_width=2, stroke_fill="white")
        return np.asarray(picture), np.asarray(Image.fromarray(depth).resize(SIZE, 0))


def main() -> None:
    """Write the page and its pictures."""
    parser = argparse.ArgumentParser(description="Make docs/effects.md and its pictures.")
    parser.add_argument("--text", action="store_true", help="the page alone")
    if not parser.parse_args().text:
        PICTURES.mkdir(parents=True, exist_ok=True)
        studio = Studio()
        for effect_id in effect_ids():
            picture = Image.fromarray(studio.picture(effect_class(effect_id)))
            picture.quantize(255, dither=Image.Dither.NONE).save(PICTURES / f"{effect_id}.png", optimize=True)
    (OUT / "effects.md").write_text(page(), encoding="utf-8")
    text = (OUT / "formats.md").read_text(encoding="utf-8")
    (OUT / "formats.md").write_text(formats(text), encoding="utf-8")
    print(f"{OUT / 'effects.md'}: {len(effect_ids())} effects", file=sys.stderr)


if __name__ == "__main__":
    main()
