"""Folders of depth pictures with a camera file: 16-bit PNG in the camera's units, or npy in metres (floats) or units.

The pictures lie in the folder itself or in its depth/; intensity images of the same names may lie in rgb/, color/ or
image/. Stamps: those of associations.txt ("stamp depth/NAME ..."), or the names, where all of them are seconds with a
decimal point; else number / rate. Poses: `poses`, or groundtruth.txt in the folder.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera, read_camera
from depthsim.errors import InputError
from depthsim.importing.options import Imported, ImportOptions
from depthsim.importing.recording import Recording, to_units, with_options
from depthsim.presets import resolve_camera
from depthsim.runs import layout
from depthsim.runs.arrays import load_npy
from depthsim.runs.png import decode_png
from depthsim.yamlfile import read_text

_SUFFIXES = (".png", ".npy")
_SECONDS = re.compile(r"\d+\.\d+")


def read_pictures(source: Path, folder: Path, options: ImportOptions) -> Imported:
    """Copy a folder of pictures into ``folder`` as a run."""
    camera = _camera(source, options)
    depth = source / "depth" if (source / "depth").is_dir() else source
    files = sorted((f for f in depth.iterdir() if f.suffix.lower() in _SUFFIXES), key=layout.by_number)
    if not files:
        raise InputError(depth, "", "holds no .png and no .npy", "give a folder of depth pictures, or a bag")
    stamps = _stamps(source, files, options.rate or camera.rate)
    recording = Recording(folder, source)
    colours = next((source / name for name in ("rgb", "color", "image") if (source / name).is_dir()), None)
    for stamp, file in zip(stamps, files, strict=True):
        recording.add(layout.DEPTH, stamp, _depth(file, camera))
        image = colours / f"{file.stem}.png" if colours else None
        if image is not None and image.exists():
            recording.add("rgb", stamp, _intensity(image, camera))
    poses = options.poses_of(source)
    frames, notes = recording.finish(camera, poses)
    return Imported(frames, poses is not None, tuple(notes))


def _camera(source: Path, options: ImportOptions) -> Camera:
    if options.camera is not None:
        camera = resolve_camera(options.camera)
    elif (source / layout.CAMERA).exists():
        camera = read_camera(source / layout.CAMERA)
    else:
        raise InputError(source, "", "has no camera.yaml", "write one there, or give `camera` camera.yaml")
    keys = {"rate": options.rate, "depth_scale": options.depth_scale, "baseline": options.baseline}
    return with_options(camera, keys)


def _stamps(source: Path, files: list[Path], rate: float) -> list[float]:
    listed = source / "associations.txt"
    if listed.exists():
        rows = [line.split() for line in read_text(listed, "a list of frames").splitlines() if line[:1].isdigit()]
        by_name = {Path(row[1]).name: row[0] for row in rows if len(row) >= 2 and row[1].startswith("depth/")}
        try:
            return [float(by_name[file.name]) for file in files]
        except KeyError as name:
            raise InputError(listed, "", f"does not name depth/{name.args[0]}", "add its line, or the rest") from None
        except ValueError as error:
            raise InputError(listed, "", str(error), "write `stamp depth/NAME`") from None
    if all(_SECONDS.fullmatch(file.stem) for file in files):
        return [float(file.stem) for file in files]
    return [index / rate for index in range(len(files))]


def _depth(file: Path, camera: Camera) -> NDArray[np.uint16]:
    picture: NDArray[Any] = load_npy(file) if file.suffix.lower() == ".npy" else decode_png(file)
    if picture.ndim == 3 and picture.shape[2] == 1:
        picture = picture[..., 0]
    if picture.ndim != 2:
        raise InputError(file, "", f"has the shape {picture.shape}", "give (height, width)")
    if picture.dtype.kind == "f":
        return to_units(picture, camera.depth_scale)
    if picture.dtype != np.uint16:
        raise InputError(file, "", f"holds {picture.dtype}", "give 16-bit units, or metres as floats in a .npy")
    return picture


def _intensity(file: Path, camera: Camera) -> NDArray[np.uint8]:
    image = decode_png(file)
    if image.dtype != np.uint8 or image.shape[:2] != camera.shape:
        problem = f"is {image.shape[1]}x{image.shape[0]} of {8 * image.itemsize} bits"
        raise InputError(file, "", problem, f"give 8-bit images of {camera.width}x{camera.height}")
    return image.astype(np.uint8, copy=False)
