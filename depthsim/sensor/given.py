"""Clean depth from anywhere, such as another simulator: read from arrays and tensors, and checked."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.scene import NO_TAG


def as_depth(depth: Any, camera: Camera) -> tuple[NDArray[np.float32], bool]:
    """(N, height, width) float32 [m] of a NumPy array, or of anything that has DLPack or ``__array__``; if it is one.

    Raises :class:`InputError` for what is no depth of that camera: another shape, no floats, NaN, infinite, negative.
    """
    array = _array(depth, "depth")
    if array.dtype.kind != "f":
        fix = "give metres as floats, such as `depth * 0.001` of millimetres"
        raise InputError("depth", "", f"is {array.dtype}, not float", fix)
    if array.ndim not in (2, 3) or array.shape[-2:] != camera.shape or not array.size:
        height, width = camera.shape
        problem = f"has the shape {array.shape}, not ({height}, {width}) or (N, {height}, {width})"
        raise InputError("depth", "", problem, "give the depth of this camera, or the camera of this depth")
    frames = np.ascontiguousarray(array.reshape(-1, *camera.shape), np.float32)
    wrong = ~(np.isfinite(frames) & (frames >= 0))
    if wrong.any():
        frame, v, u = (int(k[0]) for k in np.nonzero(wrong))
        place = f"frame {frame}, pixel ({u}, {v})" if array.ndim == 3 else f"pixel ({u}, {v})"
        value = array.reshape(frames.shape)[frame, v, u]
        raise InputError("depth", place, f"is {value}", "give metres, and 0 where there is nothing")
    return frames, array.ndim == 2


def as_tags(tag: Any, tags: Sequence[str], shape: tuple[int, ...]) -> NDArray[np.uint8]:
    """(N, height, width) uint8 indices into ``tags``, of material ids of that shape or of one frame; None is 0."""
    if tag is None:
        return np.broadcast_to(np.uint8(0), shape)
    array = _array(tag, "tag")
    if array.dtype.kind not in "iu":
        raise InputError("tag", "", f"is {array.dtype}, not whole numbers", f"give indices into {', '.join(tags)}")
    if array.shape not in (shape, shape[1:]):
        raise InputError("tag", "", f"has the shape {array.shape}, the depth {shape}", "give an index for every pixel")
    wrong = array[((array < 0) | (array >= len(tags))) & (array != NO_TAG)]
    if wrong.size:
        problem = f"has the index {int(wrong[0])}, but there are {len(tags)} tags"
        raise InputError("tag", "", problem, f"name as many in `tags`, or {NO_TAG} where there is nothing")
    return np.broadcast_to(array.astype(np.uint8), shape)


def _array(given: Any, name: str) -> NDArray[Any]:
    try:
        if not isinstance(given, np.ndarray) and hasattr(given, "__dlpack__"):
            return np.from_dlpack(given)
        return np.asarray(given)
    except Exception as error:  # whatever another library raises: a tensor on a GPU, one with a gradient, a ragged list
        fix = "give an array, or a tensor on the CPU without gradient (`.detach().cpu()`)"
        raise InputError(name, "", f"cannot be read ({error})", fix) from None
