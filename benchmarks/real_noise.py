"""Real frames beside the same frames simulated: noise, its correlation, what repeats, and what happens at edges.

    ./run python benchmarks/real_noise.py [--data ../shared/data] [--reports DIR] [--markdown]

For both sets of real frames, aligned_table and d435_floor: the recording, its floor, and the profiles `paper`, `d435`,
the one that `depthsim diagnose SET` wrote to DIR/SET/sensor.yaml (made where it is not there; minutes), and one made by
hand where it is nearer (aligned_table.yaml). The frames are those that `generate --like SET` makes, with seed 0.

The floor of a figure is how far the recording is from itself: the root mean square of the differences between its
three thirds in time. It knows nothing of another camera, table or day, so it is small, and a third of the frames gives
it no more than a rough size. Figures of the simulation follow with their distance from the recording's in floors.

The floor's scene is the floor alone, so what happens at edges is compared with frames of the scene `office`.
"""

import argparse
import subprocess
import sys
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.real_figures import (
    Surface,
    edge_figures,
    growth_figures,
    noise_figures,
    office,
    surface_frames,
)
from depthsim.runs import Run
from depthsim.sensor import Profile, load_profile

Figures = dict[str, float]
SETS = ("aligned_table", "d435_floor")
DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
PARTS = 3
MANY = 40
"""Of more frames than this, every eighth pair is used."""


def used(run: Run) -> list[int]:
    """The frames that figures are of: all of a few, pairs of many."""
    if len(run) <= MANY:
        return list(range(len(run)))
    return [k for first in range(0, len(run) - 1, 8) for k in (first, first + 1)]


def floor_of(frames: Sequence[Surface]) -> Figures:
    """How far the recording is from itself: rms of the differences between its thirds."""
    size = len(frames) // PARTS
    parts = [noise_figures(frames[k * size : (k + 1) * size]) for k in range(PARTS)]
    return {
        name: float(np.sqrt(np.mean([(a[name] - b[name]) ** 2 for a, b in combinations(parts, 2)])))
        for name in parts[0]
    }


def diagnosed(data: Path, name: str, reports: Path) -> Path:
    """The profile that the diagnosis of a set wrote."""
    if not (reports / name / "sensor.yaml").is_file():
        command = [sys.executable, "-m", "depthsim", "diagnose", str(data / name), "--out", str(reports / name)]
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return reports / name / "sensor.yaml"


class Printer:
    """Tables, for the terminal or as markdown."""

    def __init__(self, *, markdown: bool) -> None:
        self.markdown, self.console = markdown, Console()

    def show(self, title: str, columns: dict[str, Figures], floor: Figures | None = None) -> None:
        """The first column is the recording."""
        real, *rest = columns
        heads = [title, real, *(["floor"] if floor else []), *rest]
        rows = []
        for name, value in columns[real].items():
            row = [name, f"{value:.3g}", *([f"{floor[name]:.2g}"] if floor else [])]
            for column in rest:
                away = abs(columns[column][name] - value)
                row.append(f"{columns[column][name]:.3g}" + (f" ({away / floor[name]:.3g})" if floor else ""))
            rows.append(row)
        if self.markdown:
            print("\n".join("| " + " | ".join(row) + " |" for row in [heads, ["---"] * len(heads), *rows]) + "\n")
            return
        table = Table(*map(escape, heads))
        for row in rows:
            table.add_row(*map(escape, row))
        self.console.print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=DATA)
    parser.add_argument(
        "--reports", type=Path, default=Path("reports_real"), help="of the diagnoses; made where missing"
    )
    parser.add_argument("--sensor", action="append", default=[], help="another profile, beside the others")
    parser.add_argument("--markdown", action="store_true")
    options = parser.parse_args()
    printer = Printer(markdown=options.markdown)
    for name in SETS:
        run = Run.open(options.data / name)
        profiles = {p: load_profile(p) for p in ("paper", "d435", *options.sensor)}
        profiles["diagnosed"] = load_profile(str(diagnosed(options.data, name, options.reports)))
        if (by_hand := Path(__file__).with_name(f"{name}.yaml")).is_file():
            profiles["by hand"] = load_profile(str(by_hand))
        frames = {"recording": surface_frames(run, None, used(run))}
        frames |= {key: surface_frames(run, profile, used(run)) for key, profile in profiles.items()}
        noise = {key: noise_figures(some) for key, some in frames.items()}
        printer.show(f"{name}, {len(used(run))} frames", noise, floor_of(frames["recording"]))
        if len(run) > MANY:
            growth(printer, name, frames, profiles["d435"])


def growth(printer: Printer, name: str, frames: dict[str, list[Surface]], d435: Profile) -> None:
    """What only a moving camera shows."""
    printer.show(f"{name}, growth", {key: growth_figures(some) for key, some in frames.items()})
    cluttered = [frame.disparity for frame in frames["recording"][::2]]
    edges = {"recording": edge_figures(cluttered), "d435 in the office": edge_figures(office(d435, len(cluttered)))}
    printer.show(f"{name}, edges", edges)


if __name__ == "__main__":
    main()
