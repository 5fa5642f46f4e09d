"""Files that appear whole or not at all, and the lock that keeps a second writer out."""

import errno
import fcntl
import hashlib
import os
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO

from depthsim.errors import InputError

LOCK = ".lock"


def write_whole(path: Path, data: bytes) -> None:
    """Write a file under another name beside it, then put it in place; on an error nothing is left of it."""
    beside = path.with_name(f".{path.name}.tmp")
    try:
        beside.write_bytes(data)
        beside.replace(path)
    except BaseException as error:
        with suppress(OSError):
            beside.unlink(missing_ok=True)
        if isinstance(error, OSError):
            raise cannot_write(path, error) from None
        raise


def is_leftover(name: str) -> bool:
    """Whether a file is what :func:`write_whole` leaves behind when it is killed."""
    return name.startswith(".") and name.endswith(".tmp")


def make_folder(path: Path) -> None:
    """Make a folder, and those it lies in, where they are not there."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(path, "", "is a file, not a folder", "give the path of a folder") from None
    except OSError as error:
        raise cannot_write(path, error) from None


def cannot_write(path: Path, error: OSError) -> InputError:
    """What to say of a write that failed."""
    problem = f"cannot be written ({(error.strerror or str(error)).lower()})"
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return InputError(path, "", problem, "free some space and give the same command again: whole frames are kept")
    return InputError(path, "", problem, "give a path where you may write")


class FolderLock:
    """Held by the one who writes into a folder. The system lets go of it when the process ends, however it ends."""

    def __init__(self, folder: Path) -> None:
        self._path = folder / LOCK
        self._file: BinaryIO | None = None
        while self._file is None:
            self._file = self._acquire(folder)

    def _acquire(self, folder: Path) -> BinaryIO | None:
        try:
            file = self._path.open("ab")
        except OSError as error:
            raise cannot_write(self._path, error) from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.close()
            raise InputError(folder, "", "is being written by another process", "wait for it, or end it") from None
        except OSError:
            pass  # some network file systems have no locks
        # The one who had it may have removed the file after we opened it: then we hold a lock on nothing.
        try:
            if os.path.samestat(os.fstat(file.fileno()), self._path.stat()):
                return file
        except FileNotFoundError:
            pass
        file.close()
        return None

    def release(self) -> None:
        """Let go, and remove the file; a second call does nothing."""
        if self._file is not None:
            with suppress(OSError):
                self._path.unlink()
            self._file.close()
            self._file = None


def sha256(path: Path) -> str:
    """Of a file's bytes, as ``sha256sum`` prints it."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
