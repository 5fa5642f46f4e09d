"""A folder that appears whole or not at all."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from depthsim.errors import InputError
from depthsim.runs.storing import FolderLock, cannot_write, make_folder


@contextmanager
def whole_folder(out: Path) -> Iterator[Path]:
    """A folder to write into, which becomes ``out`` at the end and is gone after an error; its name is that of ``out``.

    Raises :class:`InputError` where ``out`` holds something, where another process is making it, and where the disk
    refuses.
    """
    out = Path(out).absolute()
    refuse_taken(out)
    beside = out.with_name(f".{out.name}.part")
    make_folder(beside)
    lock = FolderLock(beside)
    part = beside / out.name
    try:
        shutil.rmtree(part, ignore_errors=True)  # what a killed process left
        part.mkdir()
        yield part
        if out.is_dir():
            out.rmdir()
        part.replace(out)
    except OSError as error:
        raise cannot_write(out, error) from None
    finally:
        shutil.rmtree(part, ignore_errors=True)
        lock.release()
        shutil.rmtree(beside, ignore_errors=True)


def refuse_taken(out: Path) -> None:
    """Raise :class:`InputError` where ``out`` is a file or a folder that holds something."""
    if out.exists() and not out.is_dir():
        raise InputError(out, "", "is a file, not a folder", "give the path of a folder that is not there yet")
    if out.is_dir() and any(out.iterdir()):
        raise InputError(out, "", "is there already and holds files", "give another `out`, or remove the folder")
