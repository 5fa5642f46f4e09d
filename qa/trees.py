"""What lies in a folder, for comparing two."""

from pathlib import Path

from depthsim.runs.storing import sha256

WHO = ("work.parquet",)
"""The file of a sweep that says who made what, and how fast."""


def tree(folder: Path, without: tuple[str, ...] = ()) -> dict[str, str]:
    """Every file under a folder by its relative path, as a hash of its bytes; but those of the names ``without``."""
    files = sorted(path for path in folder.rglob("*") if path.is_file() and path.name not in without)
    return {str(path.relative_to(folder)): sha256(path) for path in files}
