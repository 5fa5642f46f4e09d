"""Folders of clean depth, as any simulator writes them, into what a camera would store of it."""

import io
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera, read_camera
from depthsim.errors import InputError
from depthsim.materials import Materials
from depthsim.presets import PRESETS, load_camera
from depthsim.runs import layout
from depthsim.runs.arrays import load_npy
from depthsim.runs.png import decode_png, encode_png
from depthsim.runs.whole import whole_folder
from depthsim.sensor import Effect, Profile, Sensor
from depthsim.sensor.given import as_depth
from depthsim.units import SATURATED

_SUFFIXES = (".png", ".npy")
_AT_ONCE = 16
"""Frames that are in memory together, besides those that a filter in time looks back at."""


def apply_folder(
    profile: str | Path | Profile | Sequence[Effect],
    source: str | Path,
    out: str | Path,
    *,
    camera: str | Path | Camera | None = None,
    material: str = "cement",
    materials: str | Path | Materials | None = None,
    seed: int = 0,
    threads: int | None = None,
    progress: Callable[[int], None] = lambda done: None,
) -> int:
    """Write what the sensor stores of the depth pictures in ``source`` to the new folder ``out``; how many frames.

    source: .png of 16 bits in units of the camera's depth_scale (65535, too far, counts as nothing), or .npy of metres
    (floats) or units (uint16), (height, width) or (N, height, width), in the order of their numbers; in the folder
    itself or in its clean/. The frames follow each other at the camera's rate. camera: of that depth; by default
    the folder's camera.yaml. material: of all surfaces.
    Each file is written under its own name as 16-bit units, beside the camera.yaml of what is stored.
    Raises :class:`InputError` for what is no such folder; then ``out`` is not written.
    """
    source = Path(source)
    files = _files(source)
    eye = _camera(source, camera, files[0])
    sensor = Sensor(camera=eye, profile=profile, materials=materials)
    keys: dict[str, Any] = {"seed": seed, "tags": (material,), "threads": threads}
    before, done = np.empty((0, *eye.shape), np.float32), 0
    with whole_folder(Path(out)) as folder:
        for file in files:
            stored = []
            array = _read(file)
            for frames in _frames(file, array, eye):
                whole = np.concatenate([before, frames])
                made = sensor.apply(whole, index=done - len(before), **keys)
                stored.append(made.depth_raw[len(before) :])
                done += len(frames)
                before = whole[max(len(whole) - sensor.looks_back, 0) :]
                progress(done)
            pictures = np.concatenate(stored) if array.ndim > 2 else stored[0][0]
            (folder / file.name).write_bytes(encode_png(pictures) if file.suffix.lower() == ".png" else _npy(pictures))
        sensor.stored_camera.write(folder / layout.CAMERA)
    return done


def _files(source: Path) -> list[Path]:
    if not source.is_dir():
        raise InputError(source, "", "is no folder", "give a folder of .png or .npy depth pictures")
    folder = source / "clean" if (source / "clean").is_dir() else source
    files = sorted((f for f in folder.iterdir() if f.suffix.lower() in _SUFFIXES), key=layout.by_number)
    if not files:
        raise InputError(folder, "", "holds no .png and no .npy", "give a folder of depth pictures")
    return files


def _camera(source: Path, camera: str | Path | Camera | None, first: Path) -> Camera:
    """The camera; a preset has the size of the first picture."""
    if isinstance(camera, str) and camera.lower() in PRESETS:
        height, width = _read(first).shape[-2:]
        return load_camera(camera, width, height)
    if camera is not None:
        return load_camera(camera)
    if (source / layout.CAMERA).exists():
        return read_camera(source / layout.CAMERA)
    raise InputError(source, "", "has no camera.yaml", "write one there, or give `camera` camera.yaml or a preset")


def _read(file: Path) -> NDArray[Any]:
    if file.suffix.lower() == ".png":
        picture = decode_png(file)
        if picture.dtype != np.uint16:
            raise InputError(file, "", f"is an image of 8 bits with the shape {picture.shape}", "give 16-bit depth")
        return picture
    array = load_npy(file)
    if array.ndim < 2:
        raise InputError(file, "", f"has the shape {array.shape}", "give (height, width) or (N, height, width)")
    return array


def _frames(file: Path, array: NDArray[Any], camera: Camera) -> Iterator[NDArray[np.float32]]:
    """(some, height, width) [m], checked."""
    if array.dtype == np.uint16:
        array = np.where(array == SATURATED, 0, array * np.float32(camera.depth_scale))
    try:
        frames, _ = as_depth(array, camera)
    except InputError as error:
        raise InputError(file, error.place, error.problem, error.fix) from None
    for begin in range(0, len(frames), _AT_ONCE):
        yield frames[begin : begin + _AT_ONCE]


def _npy(pictures: NDArray[np.uint16]) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, pictures)
    return buffer.getvalue()
