"""Rays that go elsewhere than the calibration says: by other intrinsics, bent with the image radius, or jittering."""

from typing import ClassVar

import numpy as np

from depthsim.draws import BLOCK, normal_block
from depthsim.kernels import kernel
from depthsim.parallel import split
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.noise_field import Correlation, noise_field
from depthsim.sensor.view import View


@kernel
def _bend(start, stop, k1, k2, p1, p2, x, y, bent_x, bent_y):
    a, b, out_a, out_b = x[start:stop], y[start:stop], bent_x[start:stop], bent_y[start:stop]
    two = np.float32(2)
    for i in range(a.size):
        r2, ab = a[i] * a[i] + b[i] * b[i], two * a[i] * b[i]
        radial = np.float32(1) + r2 * (k1 + r2 * k2)
        out_a[i] = a[i] * radial + p1 * ab + p2 * (r2 + two * a[i] * a[i])
        out_b[i] = b[i] * radial + p2 * ab + p1 * (r2 + two * b[i] * b[i])


def _decentred(axis: str) -> float:
    about = f"what the calibration left of the lens being off the middle in {axis}"
    term: float = parameter(
        0.0, low=-0.05, high=0.05, unit="1", neutral=0, about=about, source="assumed: none", starts=(0.0,), step=0.001
    )
    return term


class LensDistortion(Effect):
    """The ray through (x, y) at z = 1, r off the axis, goes through (1 + k1·r² + k2·r⁴) · (x, y).

    A decentred lens adds 2·p1·x·y + p2·(r² + 2·x²) to x and p1·(r² + 2·y²) + 2·p2·x·y to y.
    """

    id: ClassVar[str] = "lens_distortion"
    stage: ClassVar[Stage] = Stage.OPTICS
    source: ClassVar[str] = "D. C. Brown, 'Decentering distortion of lenses', 1966"
    axes = ("image_radius", "image_position", "image_row", "image_column", "edge_distance")
    kinds = ("bias", "spread", "tail")
    recording = "a flat wall that fills the picture to its corners"
    forms = ({"p1": 0.0, "p2": 0.0}, {"k2": 0.0})

    k1: float = parameter(
        0.002,
        low=-0.2,
        high=0.2,
        unit="1",
        neutral=0,
        about="what the calibration left of the term in r³",
        source="assumed: 1 px at the corner of a D435",
        starts=(0.0, -0.03, 0.03),
    )
    k2: float = parameter(
        0.0,
        low=-0.05,
        high=0.05,
        unit="1",
        neutral=0,
        about="what the calibration left of the term in r⁵",
        source="assumed: k1 alone",
        starts=(0.0,),
        step=0.001,
    )
    p1: float = _decentred("y")
    p2: float = _decentred("x")

    @property
    def is_neutral(self) -> bool:
        """Whether no term is left."""
        return self.k1 == self.k2 == self.p1 == self.p2 == 0

    def bend(self, view: View) -> None:
        """Bend every ray."""
        bent = view.scratch.empty(view.rays.shape)
        flat = *view.rays.reshape(2, -1), *bent.reshape(2, -1)
        terms = (np.float32(term) for term in (self.k1, self.k2, self.p1, self.p2))
        split(_bend, flat[0].size, view.threads, *terms, *flat)
        view.rays = bent


_DEFAULTS = (
    "what a Kinect's driver takes without a calibration, 525 px, against that of freiburg1 (TUM RGB-D benchmark)"
)


def _focal(axis: str, value: float) -> float:
    about = f"true focal length f{axis} over that of the camera"
    focal: float = parameter(
        value, low=0.5, high=2, unit="1", neutral=1, about=about, source=_DEFAULTS, starts=(1.0,), step=0.002
    )
    return focal


def _center(axis: str, value: float) -> float:
    about = f"true principal point c{axis} minus that of the camera"
    center: float = parameter(
        value, low=-200, high=200, unit="px", neutral=0, about=about, source=_DEFAULTS, starts=(0.0,), step=0.5
    )
    return center


class Intrinsics(Effect):
    """The rays go where other intrinsics put them: x to (x - cx/f) / fx, with f the camera's own focal length [px].

    How the depth is scaled by a wrong focal length is no part of it, see baseline_scale.
    """

    id: ClassVar[str] = "intrinsics"
    stage: ClassVar[Stage] = Stage.OPTICS
    source: ClassVar[str] = "the pinhole camera; R. Hartley, A. Zisserman, 'Multiple View Geometry', 2004, section 6.1"
    axes = ("image_position", "image_row", "image_column", "image_radius", "incidence", "surface", "edge_distance")
    kinds = ("bias", "spread", "tail")
    recording = "a camera that stands still before a corner of two walls and the floor"
    exact = True

    fx: float = _focal("x", 0.985)
    fy: float = _focal("y", 0.984)
    cx: float = _center("x", -0.9)
    cy: float = _center("y", 15.8)

    @property
    def is_neutral(self) -> bool:
        """Whether they are the camera's own."""
        return self.fx == self.fy == 1 and self.cx == self.cy == 0

    def bend(self, view: View) -> None:
        """Put every ray where it goes."""
        bent, camera = view.scratch.empty(view.rays.shape), view.camera
        offsets, scales = (self.cx / camera.fx, self.cy / camera.fy), (self.fx, self.fy)
        for axis, (offset, scale) in enumerate(zip(offsets, scales, strict=True)):
            np.subtract(view.rays[axis], np.float32(offset), out=bent[axis])
            np.divide(bent[axis], np.float32(scale), out=bent[axis])
        view.rays = bent


@kernel
def _jitter(start, stop, frame, stream, key, step, rays, out):
    words, normals = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        normal_block(at // BLOCK, frame, stream, key, words, normals)
        before, after = rays[at : min(at + BLOCK, stop)], out[at : min(at + BLOCK, stop)]
        for i in range(after.size):
            after[i] = before[i] + step * normals[i]


class LateralNoise(Effect):
    """Every ray is off by sigma · N(0, 1) pixels in x and y, drawn anew for each frame, by pixel or as a smooth field.

    In a smooth field outlines wander, as they do in stereo that has nothing to match between the dots.
    """

    id: ClassVar[str] = "lateral_noise"
    stage: ClassVar[Stage] = Stage.OPTICS
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "C. V. Nguyen, S. Izadi, D. Lovell, 'Modeling Kinect Sensor Noise', 3DIMPVT 2012"
    axes = ("edge_distance", "incidence")
    kinds = ("spread", "tail")
    recording = "sharp depth edges, and slanted surfaces beside frontal ones"

    sigma: float = parameter(
        0.8,
        low=0,
        high=5,
        unit="px",
        neutral=0,
        about="standard deviation in x and in y",
        source="Nguyen 2012, a Kinect: 0.8 + 0.035·θ/(π/2 - θ) px, here without its small growth with the angle θ",
    )
    correlation: float = parameter(
        0.0,
        low=0,
        high=32,
        unit="px",
        about="lag, along rows and columns, at which two rays' errors are correlated by 1/2; 0 is each by itself",
        source="Nguyen 2012 has none; 1.5 to 4 px, with sigma 3 to 4, fit depthsim's own active stereo best",
        frozen=True,
    )

    def bend(self, view: View) -> None:
        """Move every ray."""
        draws, jittered = view.draws(self.id), view.scratch.empty(view.rays.shape)
        both = Correlation(x=self.correlation, y=self.correlation)
        for axis, focal in enumerate((view.camera.fx, view.camera.fy)):
            step = np.float32(self.sigma / focal)
            if self.correlation:
                field = noise_field(view.draws(f"{self.id} {'xy'[axis]}"), view.rays.shape[1:], both, view.threads)
                np.add(view.rays[axis], step * field, out=jittered[axis])
            else:
                flat = view.rays[axis].reshape(-1), jittered[axis].reshape(-1)
                split(_jitter, flat[0].size, view.threads, draws.frame, axis, draws.key, step, *flat, multiple=BLOCK)
        view.rays = jittered
