"""Sensor.apply, the sensor on depth from other simulators: frames a second, and how far it is from the scene's own.

    ./run python benchmarks/apply.py [--rounds 15] [--scene office]

Each effect is put on a frame that is cast in the scene, and on the clean depth of that frame alone, on common random
numbers; the profiles are, too. What differs is what depth does not show: incidence and the right imager's view beside
edges, and what a camera that is turned or moved sees beyond the picture's border and behind edges.
"""

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.measuring import least_cpu, machine, side_by_side
from depthsim.parallel import core_count
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.scenefile import load_scene
from depthsim.sensor import Effect, Sensor, effect_class, effect_ids, load_profile
from depthsim.sensor.motion import Motion
from depthsim.trajectory import load_trajectory

BATCHES = ((64, 160, 120), (1, 848, 480))
PROFILES = ("paper", "d435", "d415", "d435_filtered")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--scene", default="office")
    options = parser.parse_args()
    scene, console = load_scene(options.scene), Console()
    caster, path = Caster(scene), load_trajectory(None, scene, 30.0)
    console.print(machine())
    console.print(speeds(caster, path.matrices(), options.rounds))
    console.print(distances(caster, Motion.along(path), len(path) // 3, path.stamps))


def speeds(caster: Caster, poses: Any, rounds: int) -> Table:
    """Frames a second of each profile and batch."""
    table = Table("batch", "profile", "frames/s, median", "processor ms a frame, least")
    for count, width, height in BATCHES:
        camera = preset("d435", width, height)
        depth = caster.cast(camera, poses[:count]).depth
        sensors = {name: Sensor(camera=camera, profile=name) for name in PROFILES}
        works = {name: partial(sensor.apply, depth) for name, sensor in sensors.items()}
        seconds, busy = side_by_side(works, rounds), least_cpu(works, rounds)
        for name in PROFILES:
            rate = f"{count / float(np.median(seconds[name])):,.0f}"
            table.add_row(f"{count} of {width}x{height}", name, rate, f"{1e3 * busy[name] / count:.2f}")
    table.caption = f"{core_count()} cores; frames of one camera in a row, of which a filter in time needs those before"
    return table


def distances(caster: Caster, motion: Motion, index: int, stamps: Any) -> Table:
    """Of each effect: what differs, and its statistics both ways."""
    camera = preset("d435", 424, 240)
    stamp = float(stamps[index])
    pose = motion.at(stamp)[0]
    clean = caster.cast(camera, pose)
    table = Table(
        "effect", "holes, scene", "holes, depth", "rms error in px, scene", "in px, depth",
        "pixels that differ by 0.02 px or are a hole in one",
    )  # fmt: skip

    def row(name: str, effects: list[Effect]) -> None:
        keys: dict[str, Any] = {"index": index, "motion": motion}
        aligns = camera.color is not None and any(effect.moves_camera for effect in effects)
        at = pose @ camera.color.pose if aligns else pose  # the colour camera's, so that the left imager is at `pose`
        cast = Sensor(caster, camera, effects).measure(at, stamp=stamp, **keys)
        given = Sensor(camera=camera, profile=effects).apply(
            clean.depth, tag=clean.tag, tags=caster.scene.tags, stamps=[stamp], **keys
        )
        a, b, true = cast.depth.astype(float), given.depth.astype(float), cast.clean.depth.astype(float)
        fb, both = cast.camera.focal_baseline, (a > 0) & (b > 0) & (true > 0)
        errors = [fb * (1 / z[both] - 1 / true[both]) for z in (a, b)]
        differ = ((a > 0) != (b > 0)).sum() + (np.abs(errors[0] - errors[1]) > 0.02).sum()
        spreads = [f"{np.sqrt((np.clip(e, -5, 5) ** 2).mean()):.3f}" for e in errors]
        holes = [f"{100 * (z == 0).mean():.2f} %" for z in (a, b)]
        table.add_row(name, *holes, *spreads, f"{100 * differ / a.size:.2f} %")

    for name in PROFILES:
        row(f"profile {name}", [e for e in load_profile(name).effects if not e.looks_back])
    for effect_id in effect_ids():
        kind = effect_class(effect_id)
        if effect_id != "temporal_filter":
            row(effect_id, [*(effect_class(other)() for other in kind.seen_on), kind(**kind.shown)])
    table.caption = "one frame of 424x240, so without the filter in time"
    return table


if __name__ == "__main__":
    main()
