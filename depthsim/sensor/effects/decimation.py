"""Fewer pixels: the driver's decimation."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.kernels import kernel
from depthsim.parallel import split
from depthsim.raycast import Geometry
from depthsim.sensor.effect import Effect, Setting, Stage, parameter
from depthsim.sensor.frame import Frame

_MULTIPLE = 4
"""Width and height of what comes out are rounded up to this, with holes."""
_LARGEST_MEDIAN = 3
_LARGEST = 1280, 800
"""[px] Width and height of the largest pictures of the D400 series, RealSense datasheet 337029."""


@kernel
def _decimate(start, stop, factor, unit, nearest, given, wanted):
    """Rows ``start`` to ``stop`` of ``wanted``, which is larger than the blocks of ``given`` by its margin.

    nearest: whether means are rounded to the nearest unit, and a median is the mean of the two in the middle.
    """
    across, down = given.shape[1] // factor, given.shape[0] // factor
    found = np.empty(factor * factor, np.float32)
    for v in range(start, stop):
        wanted[v] = np.float32(0)
        for u in range(across if v < down else 0):
            count, total = 0, 0
            for y in range(v * factor, (v + 1) * factor):
                for x in range(u * factor, (u + 1) * factor):
                    z = given[y, x]
                    if z > np.float32(0):
                        total += np.int64(z / unit + np.float32(0.5))
                        at = count
                        while at > 0 and found[at - 1] > z:
                            found[at] = found[at - 1]
                            at -= 1
                        found[at] = z
                        count += 1
            if count and factor > _LARGEST_MEDIAN:
                wanted[v, u] = np.float32((total + (count // 2 if nearest else 0)) // count) * unit
            elif count:
                upper = count // 2 if nearest else (count - 1) // 2
                wanted[v, u] = np.float32(0.5) * (found[(count - 1) // 2] + found[upper])


class Decimation(Effect):
    """Blocks of ``factor``² pixels become one: the median of their depths, for factors of 4 and more the mean.

    Holes do not count; of an even number the median is the lower one, and a mean is rounded down to whole units. The
    picture is smaller by the factor, both sides rounded up to a multiple of 4 with holes, and camera.yaml has its size
    and intrinsics as the driver has them: all four divided by the factor. Effects that follow work on the smaller one.
    Other software takes the mean of the two in the middle and rounds means to the nearest unit (``nearest``), or scales
    the picture back to its size, of tiles with one value each (``upscaled``).
    """

    id: ClassVar[str] = "decimation"
    stage: ClassVar[Stage] = Stage.PROCESSING
    rank: ClassVar[int] = -2
    source: ClassVar[str] = "librealsense, src/proc/decimation-filter.cpp and doc/post-processing-filters.md"
    axes = ()
    kinds = ("spread", "missing", "tail")
    recording = "a flat frontal wall, with the camera's decimation off and on"

    factor: int = parameter(
        2,
        low=1,
        high=8,
        unit="px",
        neutral=1,
        about="side of the blocks",
        source="librealsense's default",
        starts=(2, 3, 4),
    )
    upscaled: int = parameter(
        0,
        low=0,
        high=1,
        unit="1",
        about="1: the picture is scaled back to its size, each pixel of it a tile; 0: it stays smaller",
        source="librealsense, which leaves it smaller",
        frozen=True,
    )
    nearest: int = parameter(
        0,
        low=0,
        high=1,
        unit="1",
        about="1: of an even number the median is the mean of the two in the middle, means are rounded to the nearest",
        source="librealsense, which takes the lower one and rounds down",
        frozen=True,
    )

    def stored(self, camera: Camera) -> Camera:
        """The smaller camera."""
        return camera if self.upscaled else _resized(camera, self._smaller)

    def imager(self, camera: Camera) -> Camera:
        """The camera with so many more pixels."""
        k = 1 if self.upscaled else self.factor
        return _resized(camera, lambda eye: _scaled(eye, eye.width * k, eye.height * k, k))

    def _smaller(self, camera: Camera) -> Camera:
        k = self.factor
        width, height = (max(-(-(size // k) // _MULTIPLE) * _MULTIPLE, 1) for size in (camera.width, camera.height))
        return _scaled(camera, width, height, 1 / k)

    @classmethod
    def forms_in(cls, setting: Setting) -> Sequence[Mapping[str, Any]]:
        """Upscaled where the recording has tiles."""
        return [{"upscaled": int(setting.tiled is not None), "nearest": nearest} for nearest in (0, 1)]

    @classmethod
    def possible(cls, setting: Setting) -> bool:
        """Only pictures of tiles, or of whole fours and half the size of the largest of a D400 camera, or less."""
        if setting.size is None or setting.tiled is not None:
            return True
        return all(n % _MULTIPLE == 0 and 2 * n <= most for n, most in zip(setting.size, _LARGEST, strict=True))

    @classmethod
    def bounds_in(cls, setting: Setting) -> dict[str, tuple[float, float]]:
        """No larger blocks than the largest picture has room for; as large as the recording's tiles."""
        if setting.tiled is not None:
            return {"factor": (setting.tiled, setting.tiled)}
        if setting.size is None:
            return {}
        most = min(largest // size for size, largest in zip(setting.size, _LARGEST, strict=True))
        return {"factor": (1, float(max(most, 1)))}

    def apply(self, frame: Frame) -> None:
        """Put the smaller picture in the place of the frame's."""
        camera, unit = _resized(frame.camera, self._smaller), np.float32(frame.camera.depth_scale)
        depth = frame.depth
        small = frame.empty(np.float32, camera.shape)
        split(_decimate, camera.height, frame.threads, self.factor, unit, bool(self.nearest), depth, small)
        if not self.upscaled:
            frame.resize(small, camera, self._thinned(frame.geometry, camera))
            return
        down, across = (size // self.factor for size in depth.shape)
        tiles = depth[: down * self.factor, : across * self.factor].reshape(down, self.factor, across, self.factor)
        tiles[:] = small[:down, None, :across, None]

    def _thinned(self, geometry: Geometry, camera: Camera) -> Geometry:
        """One pixel of each block, for effects that ask where a depth comes from."""

        def thinned(picture: NDArray, none: int) -> NDArray:
            out = np.full(camera.shape, none, picture.dtype)
            few = picture[:: self.factor, :: self.factor][: camera.height, : camera.width]
            out[: few.shape[0], : few.shape[1]] = few
            return out

        g, sees = geometry, geometry.right_sees
        return Geometry(
            thinned(g.depth, 0), thinned(g.face, -1), thinned(g.cosine, 0), thinned(g.tag, 255),
            None if sees is None else thinned(sees, 0),
        )  # fmt: skip


def _resized(camera: Camera, change: Callable[[Camera], Camera]) -> Camera:
    """The camera with its left imager's pictures resized, which are what is decimated of an aligned one, too."""
    return change(camera.left).aligned_to_color() if camera.aligned else change(camera)


@lru_cache(maxsize=8)
def _scaled(camera: Camera, width: int, height: int, by: float) -> Camera:
    """Kept, because it keeps its rays."""
    keys = {name: getattr(camera, name) * by for name in ("fx", "fy", "cx", "cy")}
    return camera.model_copy(update={"width": width, "height": height, **keys})
