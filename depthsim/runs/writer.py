"""Writing a run folder: frames whole or not at all, and a run that was broken off goes on to the same bytes."""

import re
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

import numpy as np
import yaml
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.moving import NAME
from depthsim.runs import layout
from depthsim.runs.png import encode_png, is_whole_png
from depthsim.runs.storing import LOCK, FolderLock, cannot_write, is_leftover, make_folder, write_whole
from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.tum import tum_text
from depthsim.yamlfile import parse_yaml, read_mapping, read_text

_FRAME = re.compile(r"-?\d+\.\d{6}\.png")
_LISTS = tuple(layout.list_name(stream) for stream in layout.LISTED)
_RETRY = "give another `path`, or `overwrite`"


class RunWriter:
    """Writes one run folder; made again with the same arguments after a break, it goes on where it was.

    path: the folder; it is made, and may exist if it is empty or this very run.
    trajectory: the poses of the frames. Their stamps are rounded to microseconds, as the file names are.
    truth: all poses on the way, where more are known than those of the frames; the frames' are then interpolated in it.
    record: what the run was made from, as plain values; it becomes run.yaml. ``tags`` lists the tags of material/.
    streams: what is written for every frame, of ``layout.STREAMS``; depth always is.
    texts: more files, by name, that another call must find as they are.
    overwrite: first remove what another run left in the folder, and nothing else.

    Raises :class:`InputError` where the folder holds something else or another run (named by the key that differs),
    where another process is writing into it, and where it cannot be written. Use it as a context manager, or call
    :meth:`finish` or :meth:`close`, so that the lock is removed.
    """

    def __init__(
        self,
        path: Path,
        camera: Camera,
        trajectory: Trajectory,
        record: Mapping[str, Any],
        streams: tuple[str, ...] = (layout.DEPTH,),
        *,
        truth: Trajectory | None = None,
        texts: Mapping[str, str] = MappingProxyType({}),
        overwrite: bool = False,
    ) -> None:
        unknown = set(streams) - set(layout.STREAMS)
        if unknown or layout.DEPTH not in streams:
            raise ValueError(f"streams are depth and some of {layout.STREAMS}, not {streams}")
        self.path, self.camera = Path(path), camera
        self.streams = tuple(stream for stream in layout.STREAMS if stream in streams)
        stamps = np.round(trajectory.stamps, 6) + 0.0  # no minus before a zero
        if truth is None:
            self.trajectory = Trajectory(stamps, trajectory.positions, trajectory.quaternions, trajectory.name)
        else:  # as who reads the run will find them
            self.trajectory = truth.at(stamps)
        self.truth = truth or self.trajectory
        make_folder(self.path)
        _check_target(self.path)
        self._lock = FolderLock(self.path)
        try:
            if overwrite:
                _remove_frames(self.path)
            self._texts = texts
            self._begin({"frames": len(self.trajectory), "streams": list(self.streams), **record}, overwrite)
        except OSError as error:
            self.close()
            raise cannot_write(self.path, error) from None
        except BaseException:
            self.close()
            raise

    def _begin(self, record: dict[str, Any], overwrite: bool) -> None:
        """Write what does not depend on the frames, and find the frames that are to be made."""
        texts = {  # run.yaml first: it says that the folder is a run
            layout.RECORD: _record_text(record),
            layout.CAMERA: self.camera.to_yaml(),
            layout.GROUND_TRUTH: tum_text(self.truth),
            **self._texts,
        }
        there = {name: read_text(self.path / name, name) for name in texts if (self.path / name).exists()}
        for name, text in there.items():
            if not overwrite:
                _check_same(self.path / name, text, texts[name])
        for name, text in texts.items():
            if there.get(name) != text:
                make_folder((self.path / name).parent)
                write_whole(self.path / name, text.encode())
        for folder in (self.path, *(self.path / stream for stream in self.streams)):
            make_folder(folder)
            for file in folder.iterdir():
                if is_leftover(file.name):
                    file.unlink()
        self._missing = {index for index in range(len(self.trajectory)) if not self._is_whole(index)}
        if self._missing:  # a run with lists is a finished one
            _remove_lists(self.path)

    def _file(self, stream: str, index: int) -> Path:
        return self.path / stream / layout.frame_name(self.trajectory.stamps[index])

    def _is_whole(self, index: int) -> bool:
        return all(is_whole_png(self._file(stream, index)) for stream in self.streams)

    def missing(self) -> list[int]:
        """The numbers of the frames that are still to be written."""
        return sorted(self._missing)

    def write_frame(self, index: int, pictures: Mapping[str, NDArray[Any]]) -> None:
        """Write one frame; several threads may write different frames at the same time.

        pictures: one for each of ``streams``, (height, width): depth and clean uint16, material uint8,
        rgb uint8 with or without a last axis of 3, normal (height, width, 3) float32 unit vectors in the world.
        Raises :class:`InputError` where it cannot be written; whole files are kept.
        """
        if set(pictures) != set(self.streams):
            raise ValueError(f"a frame of this run is {self.streams}, not {tuple(pictures)}")
        for stream in self.streams:
            picture = pictures[stream]
            if picture.shape[:2] != self.camera.shape:
                raise ValueError(f"{stream} is {picture.shape}, the camera {self.camera.shape}")
            image = layout.encode_normals(picture) if stream == "normal" else picture
            if image.dtype != layout.DTYPES[stream] or image.ndim not in layout.DIMENSIONS[stream]:
                raise ValueError(f"{stream} is {picture.dtype} of shape {picture.shape}")
            write_whole(self._file(stream, index), encode_png(image))
        self._missing.discard(index)

    def finish(self) -> None:
        """Write the lists, depth.txt last: from then on the folder is a whole run. The lock is removed."""
        if self._missing:
            raise RuntimeError(f"{len(self._missing)} frames are missing, the first is {min(self._missing)}")
        for stream in layout.LISTED:
            if stream in self.streams:
                text = layout.list_text(stream, self.trajectory.stamps)
                write_whole(self.path / layout.list_name(stream), text.encode())
        self.close()

    def close(self) -> None:
        """Let other processes at the folder; what is written stays."""
        self._lock.release()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


class _Dumper(yaml.SafeDumper):
    """Writes out a value that comes twice, in place of a reference that people would have to look up."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _record_text(record: dict[str, Any]) -> str:
    head = "# What this run was made from. The same generate command finishes it after a break.\n"
    return head + yaml.dump(
        record, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=110, default_flow_style=None
    )


def _check_target(path: Path) -> None:
    """A folder may be written into if it is empty or a run that depthsim made."""
    try:
        names = [file.name for file in path.iterdir()]
    except OSError as error:
        raise cannot_write(path, error) from None
    others = [name for name in names if name != LOCK and not is_leftover(name)]
    record = path / layout.RECORD
    if others and not (record.is_file() and {"frames", "streams"} <= read_mapping(record, "a run.yaml").keys()):
        problem = f"holds {min(others)} and is not a run that depthsim made"
        raise InputError(path, "", problem, "give another `path`, or an empty folder")


def _check_same(file: Path, there: str, wanted: str) -> None:
    """Refuse to go on with a run that was made from something else."""
    if there == wanted:
        return
    if file.suffix == ".yaml":
        change = _difference(parse_yaml(there, file), parse_yaml(wanted, file))
        if change is not None:
            place, old, new = change
            raise InputError(file, place, f"is {old} in this folder, but {new} is asked for", _RETRY)
        return
    pairs = zip(there.splitlines(), wanted.splitlines(), strict=False)
    line = next((number for number, (old, new) in enumerate(pairs, start=1) if old != new), None)
    raise InputError(file, f"line {line}" if line else "", "the poses in this folder are not those asked for", _RETRY)


def _difference(old: Any, new: Any, place: str = "") -> tuple[str, str, str] | None:
    """The first place where two plain values differ, and what stands there in each."""
    if isinstance(old, dict) and isinstance(new, dict):
        keys: list[Any] = [*new, *(key for key in old if key not in new)]
        parts = [(str(key), old.get(key, _NOTHING), new.get(key, _NOTHING)) for key in keys]
    elif isinstance(old, list) and isinstance(new, list) and len(old) == len(new):
        parts = [(str(number), *pair) for number, pair in enumerate(zip(old, new, strict=True))]
    else:
        return None if old == new and type(old) is type(new) else (place, _shown(old), _shown(new))
    found = (_difference(a, b, f"{place}.{name}" if place else name) for name, a, b in parts)
    return next((change for change in found if change is not None), None)


class _Nothing:
    def __repr__(self) -> str:
        return "not there"


_NOTHING = _Nothing()


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _remove_lists(path: Path) -> None:
    for name in _LISTS:
        (path / name).unlink(missing_ok=True)


def _is_object(stream: str, file: Path) -> bool:
    stem = file.name.removesuffix(".txt").removesuffix(".motion").removesuffix(".ply")
    return stream == layout.OBJECTS and stem != file.name and NAME.fullmatch(stem) is not None


def _remove_frames(path: Path) -> None:
    """Remove what was made for a run, and no other file; run.yaml stays to the last and is written over."""
    _remove_lists(path)
    (path / layout.PREVIEW).unlink(missing_ok=True)
    (path / layout.INSTANCES).unlink(missing_ok=True)
    for stream in (*layout.STREAMS, layout.OBJECTS):
        folder = path / stream
        if folder.is_symlink():
            raise InputError(folder, "", "is a link to another folder", "remove it yourself")
        if folder.is_dir():
            for file in folder.iterdir():
                if _FRAME.fullmatch(file.name) or is_leftover(file.name) or _is_object(stream, file):
                    file.unlink()
            if not any(folder.iterdir()):
                folder.rmdir()
