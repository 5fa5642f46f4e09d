"""The folder of a report: written whole or not at all, in place of an earlier report but of nothing else."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from depthsim.errors import InputError
from depthsim.runs.storing import LOCK, cannot_write
from depthsim.runs.whole import whole_folder

DIAGNOSIS = "diagnosis.json"
_OURS = {
    DIAGNOSIS, "sensor.yaml", "before.yaml", "vehicle.yaml", "index.html", "where.npz", "report.yaml", "new_effect.py",
    "drawing.json", "scene.yaml", "scene.ply", LOCK,
}  # fmt: skip
"""All that a report may hold."""


def check_report_folder(folder: Path) -> None:
    """Raise :class:`InputError` where a report cannot be written: a file, or a folder that holds anything else."""
    if folder.exists() and not folder.is_dir():
        raise InputError(folder, "", "is a file, not a folder", "give a folder for the report")
    if not folder.is_dir():
        return
    names = sorted(path.name for path in folder.iterdir())
    foreign = [name for name in names if name not in _OURS]
    if names and (foreign or DIAGNOSIS not in names):
        other = f", such as {foreign[0]}" if foreign else ""
        raise InputError(folder, "", f"holds files that are not of a report{other}", "give another `out`")


@contextmanager
def report_folder(folder: Path) -> Iterator[Path]:
    """A folder for a report, which takes the place of ``folder`` at the end; an error leaves all as it was."""
    folder = Path(folder).absolute()
    check_report_folder(folder)
    if not folder.is_dir() or not any(folder.iterdir()):
        with whole_folder(folder) as part:
            yield part
        return
    beside = folder.with_name(f".{folder.name}.new")
    shutil.rmtree(beside, ignore_errors=True)  # what a killed process left
    with whole_folder(beside) as part:
        yield part
    old = folder.with_name(f".{folder.name}.old")
    try:
        shutil.rmtree(old, ignore_errors=True)
        folder.replace(old)
        beside.replace(folder)
    except OSError as error:
        raise cannot_write(folder, error) from None
    finally:
        if old.is_dir() and not folder.exists():
            old.replace(folder)
        shutil.rmtree(old, ignore_errors=True)
        shutil.rmtree(beside, ignore_errors=True)
