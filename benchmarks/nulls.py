"""False alarms: how far recordings without a gap come out above the floor, and how many are reported as a gap.

    ./run python benchmarks/nulls.py

For every scene, number of frames and profile it simulates --runs recordings of one sensor. Each stands for a real one
in turn and is scored against as many of the others as a diagnosis simulates, drawn anew --draws times; so
nothing distinguishes it from them. A diagnosis looks for causes where `excess` or `excess_by_axis` is above its
threshold (docs/thresholds.md; `--set` varies them), and may find none: a gap is claimed no more often than that.
"""

import itertools
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import stats

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.thresholds import Vary
from depthsim.draws import Seed
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.fit.validate import Validator, excess
from depthsim.materials import load_materials
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory

Floats = NDArray[np.float64]


def excesses(validator: Validator, runs: int, draws: int, number: int = 0) -> Floats:
    """(runs · draws, 2) the excess in all, and the largest along an axis, of recordings of the validator's own sensor.

    number: keys the random numbers.
    """
    generator, config = np.random.Generator(np.random.Philox(key=[number, 0x9011])), validator.config
    counts = [
        validator.simulate(validator.evidence.base, Seed("nulls", number * runs + k)).sum(axis=0) for k in range(runs)
    ]
    apart = np.zeros((runs, runs, validator.ruler.axes))
    for i, j in itertools.combinations(range(runs), 2):
        apart[i, j] = apart[j, i] = validator.ruler.by_axis(counts[i], counts[j])
    found = []
    for real, _ in itertools.product(range(runs), range(draws)):
        others = generator.choice(np.delete(np.arange(runs), real), config.runs, replace=False)
        null = apart[np.ix_(others, others)].sum(axis=1) / (config.runs - 1)
        in_all, by_axis = excess(validator.ruler, apart[real, others].mean(axis=0), null, counts[real], config)
        found.append((in_all, by_axis.max()))
    return np.array(found)


def measured(
    scene: str, frames: int, profiles: list[str], size: tuple[int, int], runs: int, draws: int, config: DepthConfig
) -> list[Floats]:
    """For each profile :func:`excesses` along a path through a scene."""
    place, materials = load_scene(scene), load_materials()
    camera = preset("d435", *size).model_copy(update={"rate": 10.0})
    path = load_trajectory(None, place, camera.rate, None)
    path = path.at(np.linspace(path.stamps[0], path.stamps[0] + min(path.duration, frames / camera.rate), frames))
    with TemporaryDirectory(prefix="depthsim_nulls_") as folder:
        generate(place, path, camera, load_profile("clean"), Path(folder) / "run", streams=("depth",))
        found = []
        for number, name in enumerate(profiles):
            evidence = Evidence(
                Run.open(Path(folder) / "run"), place, materials, load_profile(name).effects, config=config
            )
            # Profiles with effects in common must not have their random numbers in common as well.
            found.append(excesses(Validator(evidence, evidence.test), runs, draws, number))
    return found


def main(
    scene: Annotated[list[str] | None, typer.Option(help="Built-in scenes.")] = None,
    profile: Annotated[list[str] | None, typer.Option(help="Profiles.")] = None,
    frames: Annotated[list[int] | None, typer.Option(help="Frames of a recording.")] = None,
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT of the pictures.")] = "106x60",
    runs: Annotated[int, typer.Option(min=2, help="Recordings of one sensor, more than are simulated.")] = 36,
    draws: Annotated[int, typer.Option(min=1, help="How often each is scored.")] = 4,
    vary: Vary = None,
) -> None:
    """Print quantiles of the excess, and the share above the thresholds."""
    scenes = scene or ["office", "corridor", "forest", "tunnel"]
    profiles = profile or ["clean", "paper", "d435", "d415", "d455"]
    config = DepthConfig.varied(vary or [])
    width, height = (int(word) for word in size.split("x"))
    found: dict[tuple[int, str], list[Floats]] = {}
    for count, name in itertools.product(frames or [4, 8, 20, 40, 100, 400], scenes):
        for one, values in zip(
            profiles, measured(name, count, profiles, (width, height), runs, draws, config), strict=True
        ):
            found.setdefault((count, one), []).append(values)
            print(f"{name}, {count} frames, {one}: at most {values.max(axis=0).round(1)}", file=sys.stderr, flush=True)
    table = Table(
        "frames", "profile", "scored", "excess 99 %", "most", "along an axis 99 %", "most", "reported as a gap", "95 %"
    )
    every = [((count, one), np.concatenate(parts)) for (count, one), parts in found.items()]
    every += [((count, "all"), _of(found, count=count)) for count in sorted({count for count, _ in found})]
    every.append(((0, "all"), np.concatenate([v for parts in found.values() for v in parts])))
    for (count, one), values in every:
        _row(table, str(count or "all"), one, values, draws, config)
    Console(width=120).print(table)
    limit = config.significance
    print(
        f"thresholds: {limit.excess:g} in all, {limit.excess_along_axis:g} along an axis; {limit.runs} runs simulated"
    )


def _of(found: dict[tuple[int, str], list[Floats]], count: int) -> Floats:
    return np.concatenate([v for (frames, _), parts in found.items() if frames == count for v in parts])


def _row(table: Table, frames: str, profile: str, values: Floats, draws: int, config: DepthConfig) -> None:
    limit = config.significance
    alarms = (values > [limit.excess, limit.excess_along_axis]).any(axis=1)
    # Scores of one recording against other draws are alike: the interval counts each recording once.
    share, recordings = float(alarms.mean()), len(values) // draws
    high = float(stats.beta.ppf(0.95, share * recordings + 1, recordings - share * recordings))
    (q_all, q_axis), (most_all, most_axis) = np.quantile(values, 0.99, axis=0), values.max(axis=0)
    cells = [f"{x:.1f}" for x in (q_all, most_all, q_axis, most_axis)]
    table.add_row(frames, profile, str(len(values)), *cells, f"{share:.2%}", f"below {high:.2%}")


if __name__ == "__main__":
    typer.run(main)
