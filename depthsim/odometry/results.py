"""What `depthsim slam` leaves: the estimate, plots, and a line in results.csv."""

import csv
import io
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.odometry.score import Score, align
from depthsim.runs.storing import make_folder, write_whole
from depthsim.trajectory import Trajectory, tum_text

COLUMNS = (
    "run", "system", "frames", "tracked", "path_m", "ate_m", "ate_max_m", "rpe_m", "rpe_deg", "drift_m_per_m",
    "drift_deg_per_m", "seconds",
)  # fmt: skip
RESULTS = "results.csv"


def row_of(run: str, system: str, frames: int, score: Score, seconds: float | None) -> dict[str, str]:
    """A line of results.csv by its columns; figures that do not exist are empty."""
    figures = (
        score.path, score.ate, score.ate_max, score.rpe, score.rpe_deg, score.drift, score.drift_deg, seconds,
    )  # fmt: skip
    words = [run, system, str(frames), str(score.matched)]
    words += ["" if value is None or not np.isfinite(value) else f"{value:.6g}" for value in figures]
    return dict(zip(COLUMNS, words, strict=True))


def write_results(out: Path, row: dict[str, str], estimate: Trajectory, truth: Trajectory) -> None:
    """Write SYSTEM.txt and SYSTEM.png to ``out``, and put the line into results.csv in place of an earlier one."""
    make_folder(out)
    name = row["system"]
    write_whole(out / f"{name}.txt", tum_text(estimate).encode())
    write_whole(out / f"{name}.png", picture(truth, estimate, row))
    put_row(out / RESULTS, row)


def put_row(file: Path, row: dict[str, str]) -> None:
    """Add a line to results.csv, or put it in place of that of the same run and system."""
    rows = read_rows(file)
    same = [index for index, old in enumerate(rows) if (old["run"], old["system"]) == (row["run"], row["system"])]
    if same:
        rows[same[0]] = row
    else:
        rows.append(row)
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_whole(file, text.getvalue().encode())


def read_rows(file: Path) -> list[dict[str, str]]:
    """The lines of a results.csv; none where there is no file."""
    if not file.exists():
        return []
    try:
        table = csv.DictReader(file.read_text(encoding="utf-8").splitlines())
        rows = list(table)
    except (UnicodeDecodeError, csv.Error):
        raise InputError(file, "", "is not a table in UTF-8", "give another `out`") from None
    if tuple(table.fieldnames or COLUMNS) != COLUMNS or any(set(row) != set(COLUMNS) for row in rows):
        raise InputError(file, "header", "is not that of depthsim's results.csv", "give another `out`")
    return rows


def picture(truth: Trajectory, estimate: Trajectory, row: dict[str, str]) -> bytes:
    """A PNG: the two paths from above and from the side, and the error over time."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    reference, aligned = align(truth, estimate)
    true, found = reference.positions_xyz, aligned.positions_xyz
    error = np.linalg.norm(found - true, axis=1)
    figure, (above, side, time) = plt.subplots(1, 3, figsize=(12, 3.8), layout="constrained")
    for axes, (a, b), names in ((above, (0, 1), "xy"), (side, (0, 2), "xz")):
        axes.plot(true[:, a], true[:, b], color="#888888", lw=2.5, label="truth")
        axes.plot(found[:, a], found[:, b], color="#d1495b", lw=1.2, label=row["system"])
        axes.set_xlabel(f"{names[0]} [m]")
        axes.set_ylabel(f"{names[1]} [m]")
        axes.set_aspect("equal", adjustable="datalim")
        axes.grid(alpha=0.25)
    above.set_title("from above")
    side.set_title("from the side")
    above.legend(frameon=False)
    time.plot(reference.timestamps - reference.timestamps[0], 100 * error, color="#d1495b", lw=1.2)
    time.set_title(f"error: ATE {100 * float(row['ate_m']):.2f} cm over {float(row['path_m']):.2f} m")
    time.set_xlabel("time [s]")
    time.set_ylabel("distance from the truth [cm]")
    time.set_ylim(bottom=0)
    time.grid(alpha=0.25)
    figure.suptitle(f"{row['system']} on {row['run']}: {row['tracked']} of {row['frames']} frames", fontsize=11)
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=100)
    plt.close(figure)
    return data.getvalue()
