"""A sweep at a URL of fsspec: s3://, gs://, abfs://, sftp://, hdfs://, memory://, file://, ...

Object stores cannot add to an object, so the journal is one object for every few seconds. A run is made in a scratch
folder of the worker's machine and its frames are sent as they are made, depth.txt last; a worker on another machine
begins with the frames that are there.
"""

import hashlib
import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from depthsim.errors import InputError
from depthsim.extras import load_extra
from depthsim.runs import layout
from depthsim.runs.storing import LOCK, is_leftover, make_folder
from depthsim.sweep.lease import Lease
from depthsim.sweep.target import PLAN, SCENES, Workplace

_IN_ONE = {"s3", "s3a", "gs", "gcs", "abfs", "abfss", "az", "adl", "oci", "oss", "memory"}
"""The stores where an object appears whole when it is written; elsewhere it is written beside and moved."""
_JOURNAL = "journal"
_DEPTH_LIST = layout.list_name(layout.DEPTH)


class FsspecTarget:
    """A folder at a URL."""

    near = False

    def __init__(self, url: str) -> None:
        fsspec = load_extra("fsspec", "sweep")
        self.url = url.rstrip("/")
        try:
            self._files, self._root = fsspec.core.url_to_fs(self.url)
        except ImportError as error:  # the package for that kind of store
            raise InputError(url, "", f"cannot be opened ({error})", "install the package that it names") from None
        except (ValueError, OSError) as error:
            raise InputError(
                url, "", f"cannot be opened ({error})", "correct the URL, or give a local folder"
            ) from None
        protocol = self._files.protocol
        self._in_one = bool(_IN_ONE & ({protocol} if isinstance(protocol, str) else set(protocol)))
        self._scratch: Path | None = None
        self._part = 0

    def _at(self, name: str) -> str:
        return f"{self._root.rstrip('/')}/{name}"

    @contextmanager
    def lock(self) -> Iterator[Callable[[], None]]:
        """Hold a lease, an object that is renewed while the sweep is under way."""
        lease = Lease(self.url, self.read, self._create, self.write, self._remove)
        lease.acquire()
        try:
            yield lease.hold
        finally:
            lease.release()

    def check_new(self) -> None:
        """Nothing may be there but what a sweep that was broken off at its beginning leaves."""
        names = {self._relative(path).split("/")[0] for path in self._files.find(self._root)}
        others = sorted(name for name in names - {LOCK, SCENES, _JOURNAL} if not is_leftover(name))
        if others and self.read(PLAN) is None:
            problem = f"holds {others[0]} and is not a sweep that depthsim made"
            raise InputError(self.url, "", problem, "give another `target`")

    def _relative(self, path: str) -> str:
        return path[len(self._root.rstrip("/")) + 1 :]

    def read(self, name: str) -> bytes | None:
        """An object's bytes."""
        try:
            data: bytes = self._files.cat_file(self._at(name))
        except (FileNotFoundError, NotADirectoryError):
            return None
        return data

    def write(self, name: str, data: bytes) -> None:
        """Write an object."""
        self._put(name, lambda path: self._files.pipe_file(path, data))

    def _put(self, name: str, put: Callable[[str], Any]) -> None:
        path = self._at(name)
        if self._in_one:
            put(path)
            return
        folder, _, last = path.rpartition("/")
        beside = f"{folder}/.{last}.tmp"
        self._files.makedirs(folder, exist_ok=True)
        put(beside)
        self._files.mv(beside, path)

    def _create(self, name: str, data: bytes) -> bool:
        """Write an object unless it is there; whether it was written."""
        path = self._at(name)
        if not self._in_one:
            self._files.makedirs(path.rpartition("/")[0], exist_ok=True)
        try:
            self._files.pipe_file(path, data, mode="create")
        except FileExistsError:
            return False
        except (TypeError, ValueError, NotImplementedError):  # this store has no exclusive writing
            if self._files.exists(path):
                return False
            self._files.pipe_file(path, data)
        return True

    def _remove(self, name: str) -> None:
        with suppress(FileNotFoundError):
            self._files.rm_file(self._at(name))

    def _list(self, name: str) -> list[str]:
        """All objects below a folder, by their names from the root, sorted."""
        self._files.invalidate_cache()
        try:
            return sorted(self._relative(path) for path in self._files.find(self._at(name)))
        except (FileNotFoundError, NotADirectoryError):
            return []

    def read_journal(self) -> bytes:
        """The lines of all parts in their order."""
        return b"".join(self.read(part) or b"" for part in self._list(_JOURNAL) if part.endswith(".jsonl"))

    def append_journal(self, lines: bytes) -> None:
        """Write another part."""
        if not self._part:
            parts = [part for part in self._list(_JOURNAL) if part.endswith(".jsonl")]
            self._part = 1 + max((int(Path(part).stem) for part in parts), default=0)
        self.write(f"{_JOURNAL}/{self._part:08d}.jsonl", lines)
        self._part += 1

    def clear_journal(self) -> None:
        """Remove the parts; their numbers go on, so that none is written twice."""
        for part in self._list(_JOURNAL):
            self._remove(part)

    def is_whole(self, run: str) -> bool:
        """Whether depth.txt, the last object of a run, is there."""
        return bool(self._files.exists(self._at(f"{run}/{_DEPTH_LIST}")))

    @contextmanager
    def workplace(self, run: str) -> Iterator[Workplace]:
        """A scratch folder that begins with the run's objects and sends every new file when it is whole."""
        folder = self._scratch_folder() / run
        shutil.rmtree(folder, ignore_errors=True)
        make_folder(folder)
        sent: dict[str, tuple[int, ...]] = {}
        try:
            sent |= self._pull(run, folder)
            yield Workplace(folder, lambda: self._push(folder, run, sent, lists=False))
            self._push(folder, run, sent, lists=True)
            there = {f"{run}/{path.relative_to(folder).as_posix()}" for path in _files(folder)}
            for name in sorted(set(sent) - there):  # such as a damaged frame that was taken away
                self._remove(name)
        finally:
            shutil.rmtree(folder, ignore_errors=True)

    def copy_run(self, run: str, folder: Path) -> None:
        """Copy a run to this machine."""
        self._pull(run, folder)

    def _pull(self, run: str, folder: Path) -> dict[str, tuple[int, ...]]:
        """Copy a run's objects; the state of each copy by the object's name."""
        states = {}
        for name in self._list(run):
            path = folder / name[len(run) + 1 :]
            if ".." in path.parts:
                raise InputError(f"{self.url}/{name}", "", "leaves the folder of its run", "remove that object")
            if not is_leftover(path.name):
                make_folder(path.parent)
                self._files.get_file(self._at(name), str(path))
                states[name] = _state(path)
        return states

    def _push(self, folder: Path, run: str, sent: dict[str, tuple[int, ...]], *, lists: bool) -> None:
        """Send what is new; depth.txt, which says that the run is whole, at the very end."""
        for path in sorted(_files(folder), key=lambda path: path.name == _DEPTH_LIST):
            name = f"{run}/{path.relative_to(folder).as_posix()}"
            if (lists or path.name != _DEPTH_LIST) and sent.get(name) != (state := _state(path)):
                self._put(name, lambda there, path=path: self._files.put_file(str(path), there))  # type: ignore[misc]
                sent[name] = state

    def scene_folder(self, name: str) -> Path:
        """A copy of a scene's folder on this machine."""
        folder = self._scratch_folder() / f"{os.getpid()}" / name
        if not (folder / "scene.yaml").is_file():
            last = f"{name}/scene.yaml"
            for file in (*(file for file in self._list(name) if file != last), last):
                path = folder / file[len(name) + 1 :]
                if ".." in path.parts:
                    raise InputError(f"{self.url}/{file}", "", "leaves the folder of its scene", "remove that object")
                make_folder(path.parent)
                self._files.get_file(self._at(file), str(path))
        return folder

    def _scratch_folder(self) -> Path:
        """A folder of this user's own on this machine, the same for all workers of the sweep."""
        if self._scratch is None:
            name = hashlib.blake2b(self.url.encode(), digest_size=8).hexdigest()
            folder = Path(tempfile.gettempdir()) / f"depthsim-sweep-{os.getuid()}-{name}"
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            if folder.is_symlink() or folder.stat().st_uid != os.getuid():
                raise InputError(folder, "", "belongs to another user", "set TMPDIR to a folder of your own")
            self._scratch = folder
        return self._scratch

    def finish(self) -> None:
        """Remove the scratch folder."""
        shutil.rmtree(self._scratch_folder(), ignore_errors=True)
        self._scratch = None


def _files(folder: Path) -> list[Path]:
    """The whole files below a scratch folder."""
    found = (path for path in folder.rglob("*") if path.is_file())
    return sorted(path for path in found if path.name != LOCK and not is_leftover(path.name))


def _state(path: Path) -> tuple[int, ...]:
    """What changes when a file is written anew: a freed inode is taken again, and the size may be the same."""
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns
