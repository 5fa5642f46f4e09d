"""From a frame to one of 256 colours for each pixel: by depth, error, material, or what became of the pixel."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import kernel
from depthsim.materials import Materials
from depthsim.parallel import core_count, split
from depthsim.units import SATURATED
from viewer import colours
from viewer.shot import Shot

_f = np.float32
Colouring = Literal["depth", "error", "material", "validity"]
_NOTHING, _VALID, _HOLE, _TOO_FAR = (np.uint8(fate) for fate in range(4))
COLOURINGS: tuple[Colouring, ...] = ("depth", "error", "material", "validity")
_DARK = np.array([18, 19, 23], np.uint8)
"""A pixel without a return, in pictures."""


@kernel
def _by_depth(start, stop, units, table, index):
    for i in range(start, stop):
        index[i] = table[units[i]]


@kernel
def _by_error(start, stop, units, scale, clean, per_metre, index):
    for i in range(start, stop):
        place = (_f(units[i]) * scale - clean[i]) * per_metre + _f(127.5)
        index[i] = np.uint8(min(max(place, _f(0)), _f(255))) if clean[i] > _f(0) else np.uint8(128)


@kernel
def _by_fate(start, stop, units, clean, index):
    for i in range(start, stop):
        back = _HOLE if clean[i] > _f(0) else _NOTHING
        index[i] = _VALID if units[i] > 0 else back
        if units[i] == SATURATED:
            index[i] = _TOO_FAR


@dataclass(frozen=True)
class Span:
    """The depths [m] between which colours run, logarithmically, and the error [m] at the end of its colours."""

    near: float = 0.3
    far: float = 6.0
    error: float = 0.05

    def fitted(self, shot: Shot) -> "Span":
        """A span of round numbers that fits a frame; this one where it still does, so that colours stay put."""
        seen = shot.depth_raw[::4, ::4]
        scale = shot.camera.depth_scale
        back = (seen > 0) & (seen < SATURATED)
        if not back.any():
            return self
        near, far = np.percentile(seen[back], [0.5, 99.5]) * scale
        low, high = self.near, self.far
        if not (low <= near * 1.02 and near < 2.5 * low and far <= 1.02 * high and high < 2.5 * far):
            low, high = _round_down(float(near)), _round_up(float(max(far, 1.2 * near)))
        error = self.error
        if shot.clean is not None:
            true = shot.clean[::4, ::4]
            both = back & (true > 0)
            if both.any():
                most = float(np.percentile(np.abs(seen[both] * np.float32(scale) - true[both]), 90))
                if not (error / 4 < most <= error):
                    error = _round_up(max(2 * most, 2 * scale))
        return Span(low, high, error)


def _round_up(value: float) -> float:
    """The next of 1, 1.5, 2, 3, 5, 7, 10, 15, ..."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-6)))
    return float(next(step * power for step in (1, 1.5, 2, 3, 5, 7, 10) if step * power >= value * (1 - 1e-9)))


def _round_down(value: float) -> float:
    power = 10.0 ** np.floor(np.log10(max(value, 1e-6)))
    return float(next(step * power for step in (7, 5, 3, 2, 1.5, 1) if step * power <= value * (1 + 1e-9)))


@dataclass(frozen=True)
class Painted:
    """index: (height, width) uint8, each pixel's place in ``palette``, (256, 3)."""

    index: NDArray[np.uint8]
    palette: colours.Palette

    def picture(self, returned: NDArray[np.bool_] | None = None) -> NDArray[np.uint8]:
        """(height, width, 3) RGB; dark where ``returned`` is false."""
        rgb = self.palette[self.index]
        if returned is not None:
            rgb[~returned] = _DARK
        return rgb


def paint(shot: Shot, how: Colouring, span: Span, tags: tuple[str, ...], materials: Materials) -> Painted:
    """The colours of a frame. Where a frame has no clean depth or no materials, those colourings show its depth."""
    index = np.empty(shot.depth_raw.shape, np.uint8)
    if how == "error" and shot.clean is not None:
        scale, per_metre = _f(shot.camera.depth_scale), _f(127.5 / span.error)
        _run(_by_error, index, shot.depth_raw, scale, shot.clean, per_metre)
        return Painted(index, colours.ERROR)
    if how == "material" and shot.tag is not None:
        return Painted(shot.tag, colours.material_colours(tags, materials))
    if how == "validity":
        clean = shot.clean if shot.clean is not None else np.ones(shot.depth_raw.shape, np.float32)
        _run(_by_fate, index, shot.depth_raw, clean)
        return Painted(index, colours.FATE)
    _run(_by_depth, index, shot.depth_raw, _places(span.near, span.far, shot.camera.depth_scale))
    return Painted(index, colours.DEPTH)


@lru_cache(maxsize=16)
def _places(near: float, far: float, scale: float) -> NDArray[np.uint8]:
    """The colour of each 16-bit depth."""
    metres = np.arange(1 << 16) * scale
    place = np.log(np.clip(metres, near, far) / near) / np.log(far / near)
    return np.asarray((255 * place).astype(np.uint8))


def _run(kernel: Callable[..., None], index: NDArray[np.uint8], *arrays: object) -> None:
    flat = [array.reshape(-1) if isinstance(array, np.ndarray) else array for array in arrays]
    split(kernel, index.size, core_count(), *flat, index.reshape(-1))
