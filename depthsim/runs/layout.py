"""The names in a run folder and what its pictures hold; the reader and the writer share them.

    camera.yaml  run.yaml  groundtruth.txt  depth.txt [clean.txt rgb.txt ir_left.txt ir_right.txt preview.png]
    depth/ [clean/ material/ normal/ instance/ rgb/ mask/ ir_left/ ir_right/]  [instances.yaml objects/]

depth/, clean/   16-bit grey, units of the camera's depth_scale; 0 is a hole or nothing hit, 65535 too far
material/        8-bit grey, the place of the material in ``tags`` of run.yaml; 255 is nothing hit
normal/          8-bit RGB, round((n + 1) * 127) of the unit normal in the world; 127 127 127 is nothing hit.
                 The direction is within 0.4 degrees; 16 bits would be twice the size of the depth, and Pillow and
                 many others cannot read 16-bit RGB.
instance/        16-bit grey, the number of the object in instances.yaml; 0 is nothing hit
objects/         where what moves is: NAME.txt, its poses at the frames, as TUM has them; NAME.ply, its mesh
rgb/             8-bit grey or RGB
ir_left/, ir_right/  8-bit grey, the rectified pair that active stereo matched
mask/            any grey or RGB, non-zero where the scene may be trusted
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

DEPTH = "depth"
STREAMS = ("clean", "material", "normal", "instance", "rgb", "ir_left", "ir_right", DEPTH)
"""In the order in which a frame is written: where its depth is, the rest is."""
DTYPES = {"clean": np.uint16, "material": np.uint8, "normal": np.uint8, "rgb": np.uint8, DEPTH: np.uint16}
DTYPES |= {"instance": np.uint16, "ir_left": np.uint8, "ir_right": np.uint8}
DIMENSIONS = {"clean": (2,), "material": (2,), "normal": (3,), "rgb": (2, 3), DEPTH: (2,)}
DIMENSIONS |= {"instance": (2,), "ir_left": (2,), "ir_right": (2,)}
LISTED = ("clean", "rgb", "ir_left", "ir_right", DEPTH)
"""The streams with a NAME.txt, for programs that take TUM RGB-D folders."""
SIDECARS = ("clean", "material", "normal", "instance", "mask")
"""The streams that are read under the names of the depth files."""

CAMERA, RECORD, GROUND_TRUTH = "camera.yaml", "run.yaml", "groundtruth.txt"
PREVIEW = "preview.png"
OBJECTS, INSTANCES = "objects", "instances.yaml"
SCENES = ("scene.yaml", "scene.obj", "scene.glb", "scene.ply")

SATURATED = 65535
"""A depth that is too far for 16 bits."""


def frame_name(stamp: float) -> str:
    """The file of the frame at ``stamp`` [s]: ``0.033333.png``."""
    return f"{stamp:.6f}.png"


def list_name(stream: str) -> str:
    """The file that lists a stream: ``depth.txt``."""
    return f"{stream}.txt"


def list_text(stream: str, stamps: NDArray[np.float64]) -> str:
    """The text of a stream's list."""
    lines = [f"{stamp:.6f} {stream}/{frame_name(stamp)}\n" for stamp in stamps]
    return "# timestamp filename\n" + "".join(lines)


def encode_normals(normals: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(height, width, 3) unit normals, zero for none, as a picture."""
    return np.rint((normals + np.float32(1)) * np.float32(127)).astype(np.uint8)


def decode_normals(picture: NDArray[np.uint8]) -> NDArray[np.float32]:
    """The unit normals in a picture of :func:`encode_normals`, float32; zero for none."""
    normals = picture.astype(np.float32) - np.float32(127)
    length = np.linalg.norm(normals, axis=-1, keepdims=True)
    return np.divide(normals, length, out=normals, where=length > 0)


def count_frames(folder: Path) -> int:
    """How many depth frames lie in a run folder that has no list yet."""
    return sum(1 for _ in (folder / DEPTH).glob("[!.]*.png"))


def by_number(file: Path) -> list[Any]:
    """The order of pictures' names, 9.png before 10.png: sort by this."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", file.stem)]
