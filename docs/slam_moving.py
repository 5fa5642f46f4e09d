"""Make table and picture of docs/moving.md: `./run python docs/slam_moving.py [FOLDER]`; FOLDER keeps what is done.

What each system loses to someone who walks through the picture: the office with the person and the door, and the same
frames without them, from two trajectories.
"""

import sys
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.odometry import SYSTEMS, estimate, score
from depthsim.odometry.results import put_row, read_rows, row_of
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import encode_png
from depthsim.runs.storing import write_whole
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.trajectory import load_trajectory

PAGE = Path(__file__).resolve().parent / "moving.md"
CASES = (("tour", "clean"), ("tour", "d435"), ("near", "clean"), ("near", "d435"))
"""Trajectories and profiles."""
SIZE, FRAMES = (424, 240), 150
BEGIN, END = "<!-- slam -->\n", "<!-- /slam -->\n"


def without_movers(scene: Scene) -> Scene:
    """What stands alone."""
    vertices, faces = scene.standing
    return replace(
        scene, vertices=scene.vertices[:vertices], faces=scene.faces[:faces], face_tags=scene.face_tags[:faces],
        movers=(), instances=(),
    )  # fmt: skip


def runs(folder: Path) -> dict[tuple[str, str, str], Run]:
    """By trajectory, profile, and `moving` or `still`."""
    scene, camera = load_scene("office_moving"), preset("d435", *SIZE)
    made = {}
    for name, profile in CASES:
        path = load_trajectory(name, scene, camera.rate, FRAMES)
        for kind, place in (("moving", scene), ("still", without_movers(scene))):
            out = folder / f"{name}_{profile}_{kind}"
            generate(place, path, camera, profile, out)
            made[name, profile, kind] = Run.open(out)
    return made


def error(run: Run, system: str, folder: Path) -> str:
    """The ATE in centimetres; what is in results.csv already is not run again."""
    rows = read_rows(folder / "results.csv")
    row = next((r for r in rows if (r["run"], r["system"]) == (run.path.name, system)), None)
    if row is None:
        found = estimate(run, system)
        try:
            row = row_of(run.path.name, system, found.frames, score(run.trajectory, found.trajectory), found.seconds)
        except InputError:
            return "lost"
        put_row(folder / "results.csv", row)
        print(f"{run.path.name} {system}: ATE {100 * float(row['ate_m']):.2f} cm", file=sys.stderr, flush=True)
    return f"{100 * float(row['ate_m']):.2g}" if float(row["ate_m"]) < 0.995 else f"{100 * float(row['ate_m']):.0f}"


def share(run: Run) -> float:
    """The share of the pixels that show something that moves."""
    moving = [number for number, one in run.instances.items() if one.poses is not None]
    return float(np.mean([np.isin(run.instance(index), moving).mean() for index in range(len(run))]))


def table(folder: Path) -> str:
    """The table, as text."""
    made = runs(folder)
    lines = ["| trajectory | profile | pixels that move | " + " | ".join(SYSTEMS) + " |"]
    lines.append("| --- " * (3 + len(SYSTEMS)) + "|")
    for name, profile in CASES:
        moving, still = made[name, profile, "moving"], made[name, profile, "still"]
        cells = [f"{error(still, system, folder)} -> {error(moving, system, folder)}" for system in SYSTEMS]
        lines.append(f"| {name} | {profile} | {100 * share(moving):.1f} % | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def picture(run: Run, frames: Sequence[int] = (20, 100)) -> bytes:
    """Of some frames intensity, depth, and the objects, each in a colour."""
    colours = np.random.default_rng(2).integers(60, 255, (len(run.instances) + 1, 3)).astype(np.uint8)
    colours[:2] = (0, 0, 0), (60, 60, 60)
    rows = []
    for index in frames:
        grey, shown = run.rgb(index), run.instance(index)
        assert grey is not None and shown is not None
        depth = (255 * np.clip(run.depth(index) / 6, 0, 1)).astype(np.uint8)
        rows.append(np.hstack([*(np.repeat(one[..., None], 3, axis=2) for one in (grey, depth)), colours[shown]]))
    return encode_png(np.vstack(rows))


def main() -> None:
    """Write the table into the page, and the picture."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(scratch)
        text = table(folder)
        write_whole(PAGE.parent / "pictures" / "moving.png", picture(Run.open(folder / "near_d435_moving")))
    page = PAGE.read_text()
    head, _, rest = page.partition(BEGIN)
    PAGE.write_text(head + BEGIN + text + END + rest.partition(END)[2])


if __name__ == "__main__":
    main()
