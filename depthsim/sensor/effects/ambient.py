"""Sunlight, which drowns the projector's pattern."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import BLOCK
from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame
from depthsim.sensor.holes import lose

_f = np.float32
_ZERO, _ONE = _f(0), _f(1)
_REFERENCE, _GRAZING = _f(2), _f(0.2)
"""[m] Where light counts as it is, whatever the falloff; the least cosine of incidence."""


@kernel
def _light(start, stop, rotation, sun, normals, face, ray_x, ray_y, lit):
    """lit = cosine between the sun and the side of the surface that the camera sees; 0 in its own shade."""
    faces, xs, ys, out = face[start:stop], ray_x[start:stop], ray_y[start:stop], lit[start:stop]
    for i in range(out.size):
        f = np.uint32(max(faces[i], np.int32(0)))
        nx, ny, nz = normals[f, 0], normals[f, 1], normals[f, 2]
        x, y = xs[i], ys[i]
        rx = rotation[0] * x + rotation[1] * y + rotation[2]
        ry = rotation[3] * x + rotation[4] * y + rotation[5]
        rz = rotation[6] * x + rotation[7] * y + rotation[8]
        cosine = nx * sun[0] + ny * sun[1] + nz * sun[2]
        cosine = -cosine if nx * rx + ny * ry + nz * rz > _ZERO else cosine
        out[i] = max(cosine, _ZERO) if faces[i] >= 0 else _ZERO


@kernel
def _outshine(start, stop, falloff, clean, cosine, lit):
    """lit · ((clean / _REFERENCE)² / cosine)^falloff."""
    light, z, c = lit[start:stop], clean[start:stop], cosine[start:stop]
    for i in range(light.size):
        if light[i] > _ZERO and z[i] > _ZERO:
            light[i] *= ((z[i] / _REFERENCE) ** 2 / max(c[i], _GRAZING)) ** falloff


@kernel
def _shade(start, stop, shadows, reached, lit):
    light, sees = lit[start:stop], reached[start:stop]
    for i in range(light.size):
        light[i] *= _ONE if sees[i] else _ONE - shadows


@kernel
def _add_noise(start, stop, noise, lit, variance):
    light, var = lit[start:stop], variance[start:stop]
    for i in range(var.size):
        var[i] += (noise * light[i]) ** 2


@kernel
def _multiply(start, stop, gain, lit, factor):
    light, f = lit[start:stop], factor[start:stop]
    for i in range(f.size):
        f[i] *= _f(1) + gain * light[i]


@kernel
def _make_holes(start, stop, frame, key, holes, lit, disparity):
    words, uniforms, chance = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        d, light = disparity[at : min(at + BLOCK, stop)], lit[at : min(at + BLOCK, stop)]
        for i in range(d.size):
            chance[i] = holes * light[i]
        lose(at // BLOCK, frame, key, chance, words, uniforms, d)


class AmbientLight(Effect):
    """Sunlit surfaces have more noise and more holes: std = noise · n·s and chance = holes · n·s, where n·s > 0.

    n is the surface's normal on the side that the camera sees, s the direction to the sun; the noise is one of the
    disparity. A surface is in shade where it turns away from the sun. Where another one hides the sun from it, it has
    the share 1 - shadows of all three: none of it under an open sky or by a window, as clear materials hide nothing;
    all of it where the mesh has a roof that the sun shines through. Of depth from elsewhere nothing is known that could
    hide the sun.

    What drowns the pattern is the sun's light beside the projector's, which falls with the square of the range z and on
    a slant, by cos θ: light counts times ((z / 2 m)² / cos θ)^falloff.
    """

    id: ClassVar[str] = "ambient_light"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = 2  # after the other noises of the disparity, as the holes have them drawn
    source: ClassVar[str] = "form assumed: the light that a matt surface catches of the sun"
    axes = ("surface", "height", "material")
    kinds = ("spread", "missing")
    inseparable = True
    recording = "the same view with and without sun"
    forms = ({"gain": 0.0, "falloff": 0.0}, {"noise": 0.0, "falloff": 0.0})
    spare_forms = ({"gain": 0.0, "falloff": 1.0}, {"noise": 0.0, "falloff": 1.0})

    noise: float = parameter(
        0.1,
        low=0,
        high=2,
        unit="px",
        neutral=0,
        about="std of the disparity in full sun",
        source="assumed",
        starts=(0.1,),
    )
    holes: float = parameter(
        0.2,
        low=0,
        high=1,
        unit="share",
        neutral=0,
        about="share of holes in full sun",
        source="assumed",
        starts=(0.1,),
    )
    gain: float = parameter(
        0.0,
        low=0,
        high=20,
        unit="1",
        neutral=0,
        about="growth of the std of all other noise in full sun",
        source="none: a noise of its own stands for it",
        starts=(1.0,),
    )
    shadows: float = parameter(
        0.0,
        low=0,
        high=1,
        unit="share",
        about="of the light that what lies in another surface's shadow lacks",
        source="none: many a mesh of a room has walls in place of windows",
        starts=(0.0, 1.0),
    )
    falloff: float = parameter(
        0.0,
        low=0,
        high=1,
        unit="1",
        neutral=0,
        about="how much of the projector's own falloff counts: 0 none of it, 1 all",
        source="none: the strength is of the ranges in sight",
    )
    azimuth: float = parameter(
        30.0,
        low=-180,
        high=180,
        unit="deg",
        about="of the sun, from the world's x towards its y",
        source="assumed",
        starts=(-135, -45, 45, 135),
        drawn_as="light.azimuth",
    )
    elevation: float = parameter(
        45.0,
        low=-90,
        high=90,
        unit="deg",
        about="of the sun, over the world's horizon",
        source="assumed",
        starts=(20, 60),
        drawn_as="light.elevation",
    )

    @property
    def is_neutral(self) -> bool:
        """Whether the sun makes neither noise nor holes."""
        return self.noise == 0 and self.holes == 0 and self.gain == 0

    @property
    def sun(self) -> NDArray[np.float32]:
        """(3,) unit vector to the sun in the world."""
        a, e = np.radians(self.azimuth), np.radians(self.elevation)
        return np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)], np.float32)

    def apply(self, frame: Frame) -> None:
        """Add the noise and set the drawn pixels to 0."""
        lit = frame.empty().reshape(-1)
        rotation = frame.motion.at(frame.stamp)[0, :3, :3].astype(np.float32).reshape(-1)
        ray_x, ray_y = frame.camera.rays.reshape(2, -1)
        face = frame.geometry.face.reshape(-1)
        frame.run(_light, rotation, self.sun, frame.scene.normals, face, ray_x, ray_y, lit)
        if self.shadows and frame.reached is not None:
            frame.run(_shade, _f(self.shadows), frame.reached(self.sun).reshape(-1), lit)
        if self.falloff:
            clean, cosine = (x.reshape(-1) for x in (frame.geometry.depth, frame.geometry.cosine))
            frame.run(_outshine, _f(self.falloff), clean, cosine, lit)
        if self.noise:
            frame.run(_add_noise, _f(self.noise), lit, frame.noise_variance.reshape(-1))
        if self.gain:
            frame.run(_multiply, _f(self.gain), lit, frame.noise_gain.reshape(-1))
        if not self.holes:
            return
        draws, disparity = frame.draws(self.id), frame.disparity.reshape(-1)
        frame.run(_make_holes, draws.frame, draws.key, _f(self.holes), lit, disparity, multiple=BLOCK)
