"""What a recording's frames are off by, in cells of the left imager's picture: from the scene, or from a sensor."""

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from depthsim.camera import Camera, distort
from depthsim.draws import Seed
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.rigid import Floats, Look
from depthsim.sensor.effect import Effect
from depthsim.sensor.effects.fixed_pattern import FixedPattern
from depthsim.sensor.effects.pose_noise import PoseNoise

_AROUND = 25
"""[px] The rows and columns over which doubled ones even out, a few times as many as they repeat themselves after."""
_AT_EDGE = 1.0
"""[px] What is off by more is no doubled row of a surface."""

Residuals = tuple[Floats, Floats, NDArray[np.intp]]
"""Of a frame's samples: what each is off by [px], what a turn, a shift, an offset and a scale do to it, its cell."""


class Cells:
    """Squares of stride px of the left imager's picture, which has the pattern, of an aligned camera too.

    shape: how many, down and across. begin: of the first one [px], where 0 is the middle of the first pixel.
    """

    def __init__(self, camera: Camera, stride: int, shape: tuple[int, int] | None = None, begin: float = -0.5) -> None:
        self.camera, self.left, self.stride, self.begin = camera, camera.left, stride, begin
        height, width = (max(n // stride, 1) for n in self.left.shape)
        self.shape = (height, width) if camera.aligned or shape is None else shape

    def at(self, rays: Floats, z: Floats) -> NDArray[np.intp]:
        """(points,) the cells of points of the camera. rays: (2, points) at z = 1; z: [m]."""
        x, y = rays
        to = np.linalg.inv(self.camera.left_pose)
        point = to[:3, :3] @ np.stack([x * z, y * z, z]) + to[:3, 3:]
        x, y = distort(point[0] / point[2], point[1] / point[2], self.left.distortion)
        at = np.stack([y * self.left.fy + self.left.cy, x * self.left.fx + self.left.cx]) - self.begin
        v, u = (np.clip(part // self.stride, 0, n - 1).astype(np.intp) for part, n in zip(at, self.shape, strict=True))
        return np.asarray(v * self.shape[1] + u)


def scene_residuals(look: Look, cells: Cells, index: int) -> Residuals:
    """What a frame is off by from the scene."""
    frame = look.frame(index, look.run.poses[index], np.zeros(6))
    place = frame.place
    if cells.camera.aligned:
        rays = look.rays.reshape(2, -1)[:, place].astype(np.float64)
        place = cells.at(rays, cells.camera.focal_baseline / frame.disparity)
    return frame.residual, np.column_stack([frame.rigid, np.ones_like(frame.disparity), frame.disparity]), place


def sensor_residuals(evidence: Evidence, others: Sequence[Effect], cells: Cells, block: int) -> Iterator[Residuals]:
    """What the frames of a block are off by from what a sensor with ``others`` shows, the mean of each cell.

    That is the scene and the biases that they make. Which rows an alignment doubles is known too roughly to tell them
    from a pattern row by row: its own bias is the mean over some rows, theirs is of pictures that are resampled alike.
    """
    same = [effect for effect in others if effect.resizes()]
    biased = [e for e in others if "bias" in e.kinds and not isinstance(e, FixedPattern | PoseNoise) and e not in same]
    fb, unit = cells.camera.focal_baseline, evidence.camera.depth_scale

    def disparities(effects: Sequence[Effect]) -> list[Floats]:
        pictures = evidence.pictures(effects, block, Seed("pattern"))
        return [np.where(one > 0, fb / (np.maximum(one, 1) * unit), np.nan) for one in pictures]

    frames = [int(index) for index in evidence.blocks[block]]
    plain = disparities(same) if same or biased else [None] * len(frames)
    shown = disparities([*same, *biased]) if biased else plain
    for index, alike, off in zip(frames, plain, shown, strict=True):
        measured, clean = evidence.run.depth(index), evidence.frames[index].geometry.depth
        mask = evidence.trusted(index)
        true = np.where(clean > 0, fb / np.maximum(clean, 1e-6), np.nan)
        bias = (
            _mean_around(alike - true) + off - alike if alike is not None and off is not None else np.zeros_like(true)
        )
        use = (measured > 0) & np.isfinite(true + bias) & (np.True_ if mask is None else mask != 0)
        z = measured[use].astype(np.float64)
        error = fb / z - true[use] - bias[use]
        place, numbers = np.unique(cells.at(cells.camera.rays[:, use].astype(np.float64), z), return_inverse=True)
        mean = np.bincount(numbers, error) / np.bincount(numbers)
        yield mean, np.empty((len(mean), 0)), place


def _mean_around(bias: Floats) -> Floats:
    """The mean of what is known, and not at an edge, over some rows and columns on each side."""
    known = np.abs(bias) < _AT_EDGE
    sums = (ndimage.uniform_filter(part.astype(float), _AROUND) for part in (np.where(known, bias, 0), known))
    return np.asarray(next(sums) / np.maximum(next(sums), 1 / _AROUND**2))
