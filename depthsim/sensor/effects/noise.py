"""Random errors of the disparity: constant, and growing with incidence, image radius or motion.

Each effect adds an independent noise, so variances add. The disparity d [px] becomes d + std · N(0, 1), which is a
depth error of about Z² / (f·b) · std. Those that grow with something have a gain besides: where it is not 0, the std of
all other noise is multiplied by 1 + gain · the same growth.
"""

from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame
from depthsim.sensor.posed import seen_from_objects

_f = np.float32
Vector = NDArray[np.float64]
_LEAST_COSINE = _f(0.17)
"""Where the growth with incidence ends, at 80°: the local noise of a D435 over a floor (aims-slam) is 0.12 px from 77.5
to 80°, 0.14 px from 80 to 85°."""
_NEAREST = _f(0.01)
"""The range [m] below which the image's speed grows no more."""


@kernel
def _add_constant(start, stop, std, variance):
    var = variance[start:stop]
    for i in range(var.size):
        var[i] += std * std


@kernel
def _add_by_incidence(start, stop, sigma, power, cosine, variance):
    var, c = variance[start:stop], cosine[start:stop]
    for i in range(var.size):
        square = min(max(c[i], _LEAST_COSINE), _f(1)) ** 2
        tangent = (_f(1) - square) / square
        more = sigma * sigma * (_f(1) - square) / square
        # No loop, which would stop the vector unit.
        more *= tangent if power > 1 else _f(1)
        more *= tangent if power > 2 else _f(1)
        more *= tangent if power > 3 else _f(1)
        var[i] += more


@kernel
def _add_by_radius(start, stop, std_per_square, x, y, variance):
    var, a, b = variance[start:stop], x[start:stop], y[start:stop]
    for i in range(var.size):
        std = std_per_square * (a[i] * a[i] + b[i] * b[i])
        var[i] += std * std


@inlined
def _flow(linear, turning, x, y, z):
    """How fast a surface at depth z goes over the picture [1/s, at z = 1] (Longuet-Higgins and Prazdny 1980)."""
    near = _f(1) / max(z, _NEAREST)
    u = (x * linear[2] - linear[0]) * near + x * y * turning[0] - (_f(1) + x * x) * turning[1] + y * turning[2]
    v = (y * linear[2] - linear[1]) * near + (_f(1) + y * y) * turning[0] - x * y * turning[1] - x * turning[2]
    return np.sqrt(u * u + v * v)


@kernel
def _add_by_motion(start, stop, all_over, sigma, linear, turning, x, y, clean, variance):
    var, z, a, b = variance[start:stop], clean[start:stop], x[start:stop], y[start:stop]
    # Read before the loop, see kernel.
    along, about = (linear[0], linear[1], linear[2]), (turning[0], turning[1], turning[2])
    for i in range(var.size):
        std = all_over + sigma * _flow(along, about, a[i], b[i], z[i])
        var[i] += std * std


@kernel
def _gain_by_incidence(start, stop, gain, cosine, factor):
    f, c = factor[start:stop], cosine[start:stop]
    for i in range(f.size):
        square = min(max(c[i], _LEAST_COSINE), _f(1)) ** 2
        f[i] *= _f(1) + gain * np.sqrt((_f(1) - square) / square)


@kernel
def _gain_by_radius(start, stop, gain_per_square, x, y, factor):
    f, a, b = factor[start:stop], x[start:stop], y[start:stop]
    for i in range(f.size):
        f[i] *= _f(1) + gain_per_square * (a[i] * a[i] + b[i] * b[i])


@kernel
def _gain_by_motion(start, stop, all_over, gain, linear, turning, x, y, clean, factor):
    f, z, a, b = factor[start:stop], clean[start:stop], x[start:stop], y[start:stop]
    along, about = (linear[0], linear[1], linear[2]), (turning[0], turning[1], turning[2])
    for i in range(f.size):
        f[i] *= _f(1) + all_over + gain * _flow(along, about, a[i], b[i], z[i])


def _gain(unit: str, where: str, starts: tuple[float, ...]) -> float:
    """The second way to grow: in proportion to the noise that is there."""
    gain: float = parameter(
        0.0,
        low=0,
        high=20,
        unit=unit,
        neutral=0,
        about=f"growth of the std of all other noise {where}",
        source="none: the D435 frames of aims-slam have a noise effect of their own",
        starts=starts,
    )
    return gain


class DisparityNoise(Effect):
    """std = sigma, everywhere: in depth it grows as range squared."""

    id: ClassVar[str] = "disparity_noise"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = 1
    source: ClassVar[str] = (
        "L. Keselman et al., 'Intel RealSense Stereoscopic Depth Cameras', CVPRW 2017, section 2.1: the error in "
        "disparity is usually constant for a stereo system"
    )
    axes = ("range", "material")
    kinds = ("spread",)
    recording = "one material at many ranges"
    law = "the basic noise"

    sigma: float = parameter(
        0.05,
        low=0,
        high=2,
        unit="px",
        neutral=0,
        about="standard deviation of the disparity",
        source="0.04 to 0.06 px near frontal on real D435 frames (aims-slam and others)",
    )

    def apply(self, frame: Frame) -> None:
        """Add the variance of the noise."""
        frame.run(_add_constant, _f(self.sigma), frame.noise_variance.reshape(-1))


class IncidenceNoise(Effect):
    """std = sigma · tan(θ)^power, θ the angle of incidence, up to 80°.

    The disparities within a matching window spread as the tangent of the surface's tilt, power 1. A real D435 over a
    floor has power 2.
    """

    id: ClassVar[str] = "incidence_noise"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = 1
    source: ClassVar[str] = (
        "C. V. Nguyen, S. Izadi, D. Lovell, 'Modeling Kinect Sensor Noise', 3DIMPVT 2012, for the growth; the "
        "tangent from D435 frames of aims-slam, where range grows with it"
    )
    axes = ("incidence", "surface")
    kinds = ("spread",)
    recording = "one wall at one range under many angles"
    forms = ({"gain": 0.0}, {"sigma": 0.0})

    sigma: float = parameter(
        0.018,
        low=0,
        high=1,
        unit="px",
        neutral=0,
        about="standard deviation of the disparity at 45°",
        source="in all 0.050 px at 40 to 60°, 0.089 at 70 to 80°, 0.136 beyond, on a floor (aims-slam, D435)",
    )

    power: int = parameter(
        1,
        low=1,
        high=4,
        unit="1",
        about="how fast sigma's noise grows",
        source="the tangent; of 1, 2 and 3, fitted on half of the D435 frames of aims-slam, 2 is nearest to the other "
        "half at 40 to 80°; Nguyen's θ²/(90° - θ)² is as near",
        starts=(1, 2),
    )
    gain: float = _gain("1", "at 45°", (0.2, 1.0))

    @property
    def is_neutral(self) -> bool:
        """Whether it neither adds noise nor makes the other noise larger."""
        return self.sigma == 0 and self.gain == 0

    def apply(self, frame: Frame) -> None:
        """Add the variance of the noise."""
        cosine = frame.geometry.cosine.reshape(-1)
        if self.sigma:
            frame.run(_add_by_incidence, _f(self.sigma), self.power, cosine, frame.noise_variance.reshape(-1))
        if self.gain:
            frame.run(_gain_by_incidence, _f(self.gain), cosine, frame.noise_gain.reshape(-1))


class VignettingNoise(Effect):
    """std = corner · (r / r of the farthest corner)², r the radius at z = 1: there is less light to the corners.

    Light falls as cos⁴ α, so shot noise against the signal grows as 1 / cos² α = 1 + r².
    """

    id: ClassVar[str] = "vignetting_noise"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "the cos⁴ law of natural vignetting, and shot noise"
    axes = ("image_radius", "image_position", "image_row", "image_column")
    kinds = ("spread",)
    recording = "a flat frontal wall that fills the picture"
    forms = ({"gain": 0.0}, {"corner": 0.0})

    corner: float = parameter(
        0.05,
        low=0,
        high=2,
        unit="px",
        neutral=0,
        about="standard deviation of the disparity in the farthest corner",
        source="assumed: as much as disparity_noise",
    )

    gain: float = _gain("1", "in the farthest corner", (0.5, 2.0))

    @property
    def is_neutral(self) -> bool:
        """Whether it neither adds noise nor makes the other noise larger."""
        return self.corner == 0 and self.gain == 0

    def apply(self, frame: Frame) -> None:
        """Add the variance of the noise."""
        rays, whole = frame.camera.rays, frame.camera.whole.rays
        corners = whole[:, :: max(whole.shape[1] - 1, 1), :: max(whole.shape[2] - 1, 1)].astype(np.float64)
        farthest = max(float((corners**2).sum(axis=0).max()), 1e-12)
        x, y = rays.reshape(2, -1)
        if self.corner:
            frame.run(_add_by_radius, _f(self.corner / farthest), x, y, frame.noise_variance.reshape(-1))
        if self.gain:
            frame.run(_gain_by_radius, _f(self.gain / farthest), x, y, frame.noise_gain.reshape(-1))


class MotionNoise(Effect):
    """std = sigma · speed: how fast a pixel's surface goes over the picture, which blurs over the exposure.

    The part 1 - ``local`` of it is by the camera's own speed, all over the picture: ω + v · the mean of 1 / Z, turning
    at ω and moving at v. On an object that moves, the camera goes as seen from it.
    """

    id: ClassVar[str] = "motion_noise"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = 1
    source: ClassVar[str] = (
        "Intel white paper 'High-speed capture mode of Intel RealSense Depth Camera D435', for the fact; H. C. "
        "Longuet-Higgins and K. Prazdny, 'The interpretation of a moving retinal image', 1980, for the speed"
    )
    axes = ("motion", "time")
    kinds = ("spread",)
    recording = "the same view at rest and in fast motion"
    forms = tuple({name: 0.0, "local": local} for local in (1.0, 0.0) for name in ("gain", "sigma"))

    sigma: float = parameter(
        0.05,
        low=0,
        high=5,
        unit="px s/rad",
        neutral=0,
        about="standard deviation of the disparity at 1 rad/s across the view, or 1 m/s past a surface 1 m away",
        source="assumed: 1.4 % of the blur at 1 rad/s (3.6 px at f = 425 px and an exposure of 8.5 ms)",
    )

    gain: float = _gain("s/rad", "at 1 rad/s", (0.2, 2.0))

    local: float = parameter(
        1.0, low=0, high=1, unit="share", about="of the speed that is each pixel's own", source="the law of blur"
    )

    @property
    def is_neutral(self) -> bool:
        """Whether it neither adds noise nor makes the other noise larger."""
        return self.sigma == 0 and self.gain == 0

    def apply(self, frame: Frame) -> None:
        """Add the variance of the noise."""
        rays, clean = frame.camera.rays.reshape(2, -1), frame.geometry.depth.reshape(-1)
        velocity = frame.motion.velocity(frame.stamp)
        objects = seen_from_objects(frame.scene, frame.geometry.face.reshape(-1), frame.motion)
        near = 0.0
        if self.local < 1 and np.any(clean > 0):
            near = float(np.mean(1 / np.maximum(clean[clean > 0], _NEAREST)))
        for size, grow, picture in (
            (self.sigma, _add_by_motion, lambda: frame.noise_variance),
            (self.gain, _gain_by_motion, lambda: frame.noise_gain),
        ):
            if not size:
                continue
            values = picture().reshape(-1)
            before = [values[pixels] for pixels, _ in objects]
            frame.run(grow, *self._by_speed(size, near, velocity), *rays, clean, values)
            for own, (pixels, relative) in zip(before, objects, strict=True):
                x, y = rays[:, pixels]
                grow(0, len(own), *self._by_speed(size, near, relative), x, y, clean[pixels], own)
                values[pixels] = own

    def _by_speed(self, size: float, near: float, velocity: tuple[Vector, Vector]) -> tuple[Any, ...]:
        """What the kernels ask: strength all over and of each pixel's own speed, linear and angular velocity."""
        linear, turning = velocity
        all_over = float(np.linalg.norm(turning) + np.linalg.norm(linear) * near)
        own = _f(size * (1 - self.local) * all_over), _f(size * self.local)
        return *own, linear.astype(_f), turning.astype(_f)
