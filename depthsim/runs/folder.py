"""Reading a recorded run, real or simulated: the TUM RGB-D layout, plus what depth needs."""

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera, read_camera
from depthsim.errors import InputError
from depthsim.runs import layout
from depthsim.runs.png import decode_png
from depthsim.trajectory.poses import GAP, TOLERANCE, Trajectory
from depthsim.trajectory.tum import read_tum
from depthsim.yamlfile import beside, read_mapping, read_text

if TYPE_CHECKING:
    from depthsim.runs.objects import RunInstance


@dataclass(frozen=True, eq=False)
class Run:
    """A run folder. Opening it checks the lists and that files are there; a picture is read when it is asked for.

    files: the depth file of each frame. rgb_files: the intensity image nearest in time to each frame, None where
    there is none within half a frame. trajectory: the camera at the frames' stamps; truth: all poses of
    groundtruth.txt, which may be denser. meta: run.yaml, {} without one. left_out: numbers of objects that
    :meth:`mask` leaves out. by_left: whether groundtruth.txt was taken to have the poses of the left imager, though the
    pictures are aligned to colour. left_by_rows: whether the left imager's focal length is by their doubled rows.

    Every method takes the number of a frame and raises :class:`InputError` for a picture that is damaged or does not
    fit the camera.
    """

    path: Path
    camera: Camera
    trajectory: Trajectory
    truth: Trajectory
    files: tuple[Path, ...]
    rgb_files: tuple[Path | None, ...]
    meta: dict[str, Any]
    left_out: frozenset[int] = frozenset()
    by_left: bool = False
    left_by_rows: bool = False

    @classmethod
    def open(cls, path: str | Path, *, posed: bool = True) -> "Run":
        """Open a run folder. Raises :class:`InputError` for what is missing, malformed or unfinished.

        posed: False takes a recording without groundtruth.txt, too; its camera then stands at the origin.
        """
        path = Path(path)
        if not os.path.isdir(path):  # which, unlike Path's, takes any text
            problem = "is a file, not a folder" if os.path.exists(path) else "no such folder"
            raise InputError(path, "", problem, "give the folder of a run")
        record = path / layout.RECORD
        meta = read_mapping(record, "a run.yaml") if record.exists() else {}
        listed = path / layout.list_name(layout.DEPTH)
        if not listed.exists():
            raise _not_a_run(path, meta)
        for name, what in ((layout.CAMERA, "the camera's keys"), (layout.GROUND_TRUTH, "the camera's poses")):
            if not (path / name).exists() and (posed or name != layout.GROUND_TRUTH):
                raise InputError(path / name, "", "is missing from the run", f"write {what} there")
        camera = read_camera(path / layout.CAMERA)
        stamps, files, lines = read_list(listed)
        if not files:
            raise InputError(listed, "", "names no frame", "write lines of `timestamp depth/NAME.png`")
        if posed or (path / layout.GROUND_TRUTH).exists():
            truth = read_tum(path / layout.GROUND_TRUTH)
        else:
            count = len(stamps)
            truth = Trajectory(stamps, np.zeros((count, 3)), np.tile([0, 0, 0, 1.0], (count, 1)), str(path))
        first, last = truth.stamps[0], truth.stamps[-1]
        for stamp, line in zip(stamps, lines, strict=True):
            if not first - TOLERANCE <= stamp <= last + TOLERANCE:
                problem = (
                    f"stamp {stamp:.6f} is outside {layout.GROUND_TRUTH}, which runs from {first:.6f} to {last:.6f}"
                )
                raise InputError(listed, line, problem, f"drop the line, or lengthen {layout.GROUND_TRUTH}")
        for stream in layout.SIDECARS:
            _check_sidecar(path, stream, files)
        rgb = _rgb_files(path, stamps, 0.5 / camera.rate)
        return cls(path, camera, truth.at(stamps), truth, files, rgb, meta)

    def __len__(self) -> int:
        return len(self.files)

    def spread(self, count: int) -> list[int]:
        """The indices of some frames, from the first to the last, evenly spread; all of a run with fewer."""
        return [int(index) for index in np.unique(np.linspace(0, len(self) - 1, count).round())]

    @property
    def stamps(self) -> NDArray[np.float64]:
        """(N,) [s], increasing."""
        return self.trajectory.stamps

    @cached_property
    def poses(self) -> NDArray[np.float64]:
        """(N, 4, 4) camera to world at the stamps, [m]."""
        return self.trajectory.matrices()

    @property
    def dense(self) -> Trajectory | None:
        """All poses of groundtruth.txt, where they are others than those of the frames: what to make a run along."""
        return None if np.array_equal(self.truth.stamps, self.stamps) else self.truth

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is to be known of camera and poses: whose they are, and how many frames lie in gaps of these."""
        found = []
        if self.left_by_rows:
            found.append(
                "camera.yaml does not say what the left imager of the aligned pictures was: a focal length of "
                f"{self.camera.left.fx:.1f} px is taken, by the rows that were doubled; write `depth:` there"
            )
        if self.by_left:
            found.append(
                "the pictures are aligned to colour, and groundtruth.txt has the poses of the left imager: taken as "
                "such"
            )
        return (*found, *gap_remarks(self.truth, self.stamps))

    @property
    def scene(self) -> Path | None:
        """The scene that lies in the folder: scene.yaml, .obj, .glb or .ply, the first of them."""
        return next((self.path / name for name in layout.SCENES if (self.path / name).is_file()), None)

    @property
    def tags(self) -> tuple[str, ...]:
        """The material tags that the numbers in :meth:`material` mean."""
        tags = self.meta.get("tags") or ()
        if not isinstance(tags, list | tuple):
            raise InputError(self.path / layout.RECORD, "tags", "is no list", "write the names of the materials there")
        return tuple(map(str, tags))

    def has(self, stream: str) -> bool:
        """Whether every frame has its picture in ``stream``: depth, clean, material, normal, instance, mask or rgb."""
        return all(self._file(stream, index) is not None for index in range(len(self)))

    def depth_raw(self, index: int) -> NDArray[np.uint16]:
        """(height, width) depth as on disk: units of camera.depth_scale, 0 is a hole, 65535 saturated."""
        return self._depth(self.files[index])

    def depth(self, index: int) -> NDArray[np.float32]:
        """(height, width) depth [m]; 0 in holes and where it is saturated."""
        return self._metres[self.depth_raw(index)]

    def saturated(self, index: int) -> NDArray[np.bool_]:
        """(height, width): where the depth was too far for 16 bits."""
        return self.depth_raw(index) == layout.SATURATED

    def clean(self, index: int) -> NDArray[np.float32] | None:
        """(height, width) depth without the sensor's effects [m], 0 where nothing was hit."""
        file = self._file("clean", index)
        return None if file is None else self._metres[self._depth(file)]

    def material(self, index: int) -> NDArray[np.uint8] | None:
        """(height, width) places in :attr:`tags`; 255 where nothing was hit."""
        return self._bytes("material", index, "8-bit grey", (2,))

    def instance(self, index: int) -> NDArray[np.uint16] | None:
        """(height, width) numbers of objects in :attr:`instances`; 0 where nothing was hit."""
        file = self._file("instance", index)
        return None if file is None else self._depth(file, "the numbers of objects")

    @cached_property
    def instances(self) -> "dict[int, RunInstance]":
        """The objects of instances.yaml by their numbers; none without it."""
        from depthsim.runs.objects import read_instances

        return read_instances(self.path)

    def normal(self, index: int) -> NDArray[np.float32] | None:
        """(height, width, 3) unit normals in the world; zero where nothing was hit."""
        picture = self._bytes("normal", index, "8-bit RGB", (3,))
        return None if picture is None else layout.decode_normals(picture)

    def rgb(self, index: int) -> NDArray[np.uint8] | None:
        """(height, width) or (height, width, 3) intensity image nearest in time."""
        return self._bytes("rgb", index, "8-bit", (2, 3))

    def mask(self, index: int) -> NDArray[np.bool_] | None:
        """(height, width): where the scene may be trusted, and no object is left out; None for a run without masks."""
        file = self._file("mask", index)
        trusted = None
        if file is not None:
            trusted = np.asarray(self._picture(file).reshape(*self.camera.shape, -1).any(axis=2))
        if not self.left_out:
            return trusted
        shown = self.instance(index)
        assert shown is not None  # or nothing could be left out
        seen = np.isin(shown, list(self.left_out), invert=True)
        return seen if trusted is None else trusted & seen

    def posed_by_left(self) -> "Run":
        """The same run, if groundtruth.txt has the left imager's poses: those of the camera of its pictures."""
        moved = self.truth.beside(np.asarray(np.linalg.inv(self.camera.left_pose)))
        return replace(self, truth=moved, trajectory=moved.at(self.stamps), by_left=True)

    def looking_at(self, objects: Iterable[str] = (), without: Iterable[str] = ()) -> "Run":
        """The same run with masks that leave out all but some ``objects``, where any are named, and those ``without``.

        Raises :class:`InputError` for a run that has no pictures of objects, and for names that it does not know.
        """
        only, hidden = list(objects), list(without)
        if not only and not hidden:
            return self
        if not self.has("instance") or not self.instances:
            fix = "make the run with `instances`, or write instance/ and instances.yaml"
            raise InputError(self.path, "", "has no pictures of its objects", fix)
        numbers = {one.name: number for number, one in self.instances.items()}
        for name in (*only, *hidden):
            if name not in numbers:
                fix = f"the objects are {', '.join(numbers)[:300]}"
                raise InputError(self.path, "instances.yaml", f"there is no object {name[:80]!r}", fix)
        others = {number for name, number in numbers.items() if only and name not in only}
        # What is no object is not one of those that are asked for.
        nothing = {0} if only else set()
        return replace(self, left_out=frozenset(others | nothing | {numbers[name] for name in hidden}))

    @cached_property
    def _metres(self) -> NDArray[np.float32]:
        """The depth [m] of each 16-bit value."""
        table = (np.arange(1 << 16) * self.camera.depth_scale).astype(np.float32)
        table[layout.SATURATED] = 0
        return table

    def _file(self, stream: str, index: int) -> Path | None:
        if stream == "rgb":
            return self.rgb_files[index]
        if stream == layout.DEPTH:
            return self.files[index]
        file = self.path / stream / self.files[index].name
        return file if file.exists() else None

    def _picture(self, file: Path) -> NDArray[np.uint8] | NDArray[np.uint16]:
        picture = decode_png(file)
        if picture.shape[:2] != self.camera.shape:
            size = f"{picture.shape[1]}x{picture.shape[0]}"
            wanted = f"{self.camera.width}x{self.camera.height}"
            raise InputError(file, "", f"is {size}, the camera is {wanted}", f"correct the file or {layout.CAMERA}")
        return picture

    def _depth(self, file: Path, what: str = "depth") -> NDArray[np.uint16]:
        picture = self._picture(file)
        if picture.dtype != np.uint16 or picture.ndim != 2:
            raise InputError(file, "", f"is {_kind(picture)}, not 16-bit grey", f"write {what} as a 16-bit grey PNG")
        return picture.astype(np.uint16, copy=False)

    def _bytes(self, stream: str, index: int, kind: str, dimensions: tuple[int, ...]) -> NDArray[np.uint8] | None:
        file = self._file(stream, index)
        if file is None:
            return None
        picture = self._picture(file)
        if picture.dtype != np.uint8 or picture.ndim not in dimensions:
            raise InputError(file, "", f"is {_kind(picture)}, not {kind}", f"write {stream} as {kind} PNG")
        return picture.astype(np.uint8, copy=False)


def open_run(run: str | Path | Run, *, posed: bool = True) -> Run:
    """A run by its folder, as :meth:`Run.open` opens it; a :class:`Run` stays as it is."""
    return run if isinstance(run, Run) else Run.open(Path(run), posed=posed)


def gap_remarks(truth: Trajectory, stamps: NDArray[np.float64]) -> tuple[str, ...]:
    """A remark where frames lie in gaps of the poses, as their own poses are then a guess."""
    lengths = truth.gaps(stamps)
    inside = int(np.count_nonzero(lengths))
    if not inside:
        return ()
    worst = int(lengths.argmax())
    longest = f"the longest {lengths[worst]:.2f} s, at the frame of {stamps[worst]:.6f}"
    text = f"{inside} of {len(stamps)} frames lie in gaps of the poses of more than {GAP:g} s ({longest})"
    return (f"{text}: their poses are interpolated; fill the gaps, or drop those frames from depth.txt",)


def _kind(picture: NDArray[Any]) -> str:
    return f"{8 * picture.itemsize}-bit {'grey' if picture.ndim == 2 else 'RGB'}"


def _not_a_run(path: Path, meta: dict[str, Any]) -> InputError:
    """What to say of a folder without depth.txt."""
    if "frames" in meta:
        problem = f"unfinished: {layout.count_frames(path)} of {meta['frames']} frames"
        return InputError(path, "", problem, "the same generate command finishes it")
    listed = path / layout.list_name(layout.DEPTH)
    return InputError(listed, "", "is missing from the run", "write lines of `timestamp depth/NAME.png` there")


def read_list(file: Path) -> tuple[NDArray[np.float64], tuple[Path, ...], tuple[str, ...]]:
    """The stamps, the files and the places of a list of "timestamp file" lines; the files are there."""
    stamps: list[float] = []
    files: list[Path] = []
    places: list[str] = []
    for number, line in enumerate(read_text(file, "a list of frames").splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith("#"):
            continue
        place = f"line {number}"
        if len(words) != 2:
            raise InputError(file, place, f"has {len(words)} columns, not 2", "write `timestamp depth/NAME.png`")
        stamp = _number(words[0])
        if not math.isfinite(stamp):
            raise InputError(file, place, f"{words[0][:40]!r} is no time stamp", "write seconds, such as 0.033333")
        if stamps and stamp <= stamps[-1]:
            problem = f"stamp {stamp:.6f} is not after the one above, {stamps[-1]:.6f}"
            raise InputError(file, place, problem, "sort the lines, each stamp once")
        path = beside(file, words[1], place)
        if not path.is_file():
            raise InputError(
                file, place, f"names {words[1]}, which is not there", "put the file there or drop the line"
            )
        stamps.append(stamp)
        files.append(path)
        places.append(place)
    return np.array(stamps), tuple(files), tuple(places)


def _number(word: str) -> float:
    try:
        return float(word.replace("_", "?"))  # float() itself takes 1_000
    except ValueError:
        return math.nan


def _check_sidecar(path: Path, stream: str, files: Iterable[Path]) -> None:
    """A stream is there for every frame or for none: a frame without a mask could mean all or nothing."""
    folder = path / stream
    present = {file.name for file in folder.iterdir()} if folder.is_dir() else set()
    missing = [file.name for file in files if file.name not in present]
    if present and missing:
        raise InputError(folder, missing[0], "no such file, though others are there", f"add it or remove {stream}/")


def _rgb_files(path: Path, stamps: NDArray[np.float64], within: float) -> tuple[Path | None, ...]:
    """For each stamp the image of rgb.txt nearest in time, at most ``within`` [s] away."""
    listed = path / layout.list_name("rgb")
    times, files, _ = read_list(listed) if listed.exists() else (np.empty(0), (), ())
    if not files:
        return (None,) * len(stamps)
    near = np.searchsorted((times[:-1] + times[1:]) / 2, stamps)
    return tuple(files[k] if abs(times[k] - s) <= within else None for k, s in zip(near, stamps, strict=True))
