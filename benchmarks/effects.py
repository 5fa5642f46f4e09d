"""What the effects cost: all of them at once against the clean cast, and each alone.

    ./run python benchmarks/effects.py [EFFECT ...] [--rounds 15] [--scene office]

An effect that bends rays or moves the camera has its frame cast anew, and one that asks for the right imager's view
has that cast, too; both are in its figure. The geometry as it is, which no effect needs then, is cast where it is asked
for, and has a line of its own.
"""

import argparse
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.measuring import least_cpu, machine, milliseconds, ratio, side_by_side
from depthsim.camera import Camera
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.scenefile import load_scene
from depthsim.sensor import Effect, Sensor, effect_class, effect_ids, load_profile
from depthsim.sensor.motion import Motion
from depthsim.sensor.sensor import Measurement
from depthsim.trajectory import load_trajectory

AIM = 4.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "effects", nargs="*", metavar="EFFECT", help="of these alone what each costs; all if none given"
    )
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--scene", default="office")
    options = parser.parse_args()
    scene, camera = load_scene(options.scene), preset("d435", 848, 480)
    path, caster = load_trajectory(None, scene, camera.rate), Caster(scene)
    motion, middle = Motion.along(path), len(path) // 3
    pose, stamp = path.matrices()[middle], float(path.stamps[middle])

    def frame(*effects: Effect) -> Callable[[], Measurement]:
        sensor = Sensor(caster, camera, effects)
        out = sensor.measure(pose, index=middle, stamp=stamp, motion=motion)
        return partial(sensor.measure, pose, index=middle, stamp=stamp, motion=motion, out=out)

    console = Console()
    console.print(machine())
    chosen = [effect_class(effect_id)() for effect_id in options.effects or effect_ids()]
    if not options.effects:
        _together(options, caster, camera, pose, frame, chosen, console)
    alone = Table("effect", "stage", "ms more than without", "casts")
    for effect in chosen:
        given = [effect_class(effect_id)() for effect_id in effect.seen_on]  # without which it would do nothing
        both = side_by_side({"without": frame(*given), "with": frame(*given, effect)}, max(options.rounds // 3, 3))
        more = milliseconds(both["with"]) - milliseconds(both["without"])
        casts = "again" if effect.stage <= 1 else "right view" if effect.needs_right else ""
        alone.add_row(effect.id, effect.stage.name.lower(), f"{more:.2f}", casts)
    console.print(alone)


def _together(
    options: argparse.Namespace,
    caster: Caster,
    camera: Camera,
    pose: NDArray[np.float64],
    frame: Callable[..., Callable[[], Measurement]],
    every: list[Effect],
    console: Console,
) -> None:
    """All effects at once, and the profiles, beside the clean cast."""
    whole = frame(*every)
    works = {
        "clean": partial(caster.cast, camera, pose, out=caster.cast(camera, pose)),
        "no effect": frame(),
        **{f"profile {name}": frame(*load_profile(name).effects) for name in ("paper", "d435", "d415", "d455")},
        f"all {len(every)} effects": whole,
        "the same, and the geometry as it is": lambda: whole().clean,
    }
    seconds, busy = side_by_side(works, options.rounds), least_cpu(works, options.rounds)
    title = f"{options.scene}, {len(caster.scene.faces):,} faces, {camera.width}x{camera.height}"
    table = Table(title, "ms, median", "ratio", "processor ms, least", "ratio", f"at most {AIM:g}")
    for name, own in seconds.items():
        figure = ratio(seconds, name, "clean")
        reached = ("yes" if figure <= AIM else "[red]no[/red]") if name.startswith("all") else ""
        cpu = f"{1e3 * busy[name]:.1f}", f"{busy[name] / busy['clean']:.2f}"
        table.add_row(name, f"{milliseconds(own):.1f}", f"{figure:.2f}", *cpu, reached)
    console.print(table)


if __name__ == "__main__":
    main()
