"""Where a sweep is written: a local folder here, any URL of fsspec in ``remote.py``."""

import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from depthsim.errors import InputError
from depthsim.runs import layout
from depthsim.runs.storing import LOCK, FolderLock, cannot_write, is_leftover, make_folder, write_whole

PLAN, MANIFEST, WORK, SWEEP = "plan.json", "manifest.parquet", "work.parquet", "sweep.yaml"
JOURNAL = "journal.jsonl"
RUNS, SCENES = "runs", "scenes"
_OWN = {PLAN, MANIFEST, WORK, SWEEP, JOURNAL, RUNS, SCENES, LOCK}


@dataclass(frozen=True)
class Workplace:
    """Where a worker writes a run. folder: on this machine. push: to be called when a frame is whole."""

    folder: Path
    push: Callable[[], None] = lambda: None


class Target(Protocol):
    """What a sweep needs of a place to write to. Names are relative, with slashes.

    Every method raises :class:`InputError` or OSError where the place refuses.
    """

    url: str
    near: bool
    """whether it costs nothing to look whether a file is there"""

    def lock(self) -> AbstractContextManager[Callable[[], None]]:
        """Keep other drivers out. What it gives is called now and then, and raises where the lock was lost."""

    def check_new(self) -> None:
        """Raise :class:`InputError` where something else lies there."""

    def read(self, name: str) -> bytes | None:
        """A file, None where there is none."""

    def write(self, name: str, data: bytes) -> None:
        """Write a file, whole or not at all."""

    def read_journal(self) -> bytes:
        """All lines since the journal was last cleared; a line that was cut off is left out."""

    def append_journal(self, lines: bytes) -> None:
        """Add lines to the journal."""

    def clear_journal(self) -> None:
        """Begin a new journal."""

    def is_whole(self, run: str) -> bool:
        """Whether the last file of a run is there."""

    def copy_run(self, run: str, folder: Path) -> None:
        """Copy what there is of a run into a folder of this machine."""

    def workplace(self, run: str) -> AbstractContextManager[Workplace]:
        """A folder that holds what there is of a run; what is written there ends up in the target."""

    def scene_folder(self, name: str) -> Path:
        """A planned scene's folder on this machine."""

    def finish(self) -> None:
        """Remove what was only of use while the sweep was under way."""


def open_target(url: str | Path) -> Target:
    """The target of a path, or of a URL such as s3://bucket/sweep."""
    if "://" not in str(url):
        return LocalTarget(Path(url))
    from depthsim.sweep.remote import FsspecTarget

    return FsspecTarget(str(url))


class LocalTarget:
    """A folder of this machine, or of a file system that all machines have."""

    near = True

    def __init__(self, root: Path) -> None:
        self.root, self.url = root.absolute(), str(root.absolute())
        self._length: int | None = None

    @contextmanager
    def lock(self) -> Iterator[Callable[[], None]]:
        """Hold the folder's lock, which the system lets go of however this process ends."""
        is_new = not self.root.exists()
        make_folder(self.root)
        lock = FolderLock(self.root)
        try:
            yield lambda: None
        finally:
            lock.release()
            if is_new and not any(self.root.iterdir()):  # the sweep was refused
                self.root.rmdir()

    def check_new(self) -> None:
        """A folder may become a sweep if it is empty, or if a sweep was broken off before its plan was written."""
        others = sorted(f.name for f in self.root.iterdir() if f.name not in _OWN and not is_leftover(f.name))
        if others:
            problem = f"holds {others[0]} and is not a sweep that depthsim made"
            raise InputError(self.root, "", problem, "give another `target`, or an empty folder")

    def read(self, name: str) -> bytes | None:
        """A file's bytes."""
        try:
            return (self.root / name).read_bytes()
        except (FileNotFoundError, NotADirectoryError):
            return None

    def write(self, name: str, data: bytes) -> None:
        """Write a file."""
        path = self.root / name
        make_folder(path.parent)
        write_whole(path, data)

    def read_journal(self) -> bytes:
        """The journal's whole lines."""
        data = self.read(JOURNAL) or b""
        return data[: data.rfind(b"\n") + 1]

    def append_journal(self, lines: bytes) -> None:
        """Add lines. What a full disk or a killed driver left of a line is cut off first."""
        path = self.root / JOURNAL
        whole = len(self.read_journal()) if self._length is None else self._length
        try:
            with path.open("r+b" if path.exists() else "w+b", buffering=0) as file:
                file.truncate(whole)
                file.seek(whole)
                written = file.write(lines)
                if written != len(lines):  # the disk took a part
                    file.write(lines[written:])
        except OSError as error:
            raise cannot_write(path, error) from None
        self._length = whole + len(lines)

    def clear_journal(self) -> None:
        """Remove the journal."""
        (self.root / JOURNAL).unlink(missing_ok=True)
        self._length = 0

    def is_whole(self, run: str) -> bool:
        """Whether depth.txt, the last file of a run, is there."""
        return (self.root / run / layout.list_name(layout.DEPTH)).is_file()

    def copy_run(self, run: str, folder: Path) -> None:
        """Copy a run."""
        shutil.copytree(self.root / run, folder, dirs_exist_ok=True)

    @contextmanager
    def workplace(self, run: str) -> Iterator[Workplace]:
        """The run's own folder."""
        yield Workplace(self.root / run)

    def scene_folder(self, name: str) -> Path:
        """The scene's own folder."""
        return self.root / name

    def finish(self) -> None:
        """Remove what killed drivers left."""
        for file in self.root.iterdir():
            if is_leftover(file.name):
                with suppress(OSError):
                    file.unlink()


def link(source: Path, path: Path) -> None:
    """Put a file at ``path`` as a second name of ``source``, or as a copy where the file system has no links left."""
    beside = path.with_name(f".{path.name}.tmp")
    try:
        beside.unlink(missing_ok=True)
        try:
            os.link(source, beside)
        except OSError:  # another disk, no links there, or too many of this file (65,000 on ext4)
            shutil.copyfile(source, beside)
        beside.replace(path)
        beside.unlink(missing_ok=True)  # two names of one file: replace() has left both
    except OSError as error:
        raise cannot_write(path, error) from None
