"""Noise that grows with range as the surface's material has it: the paper's law."""

from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, FiniteFloat

from depthsim.draws import BLOCK, normal_block
from depthsim.kernels import inlined, kernel
from depthsim.llvm import bits_float
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame
from depthsim.sensor.noise_field import Correlation
from depthsim.sensor.parameter import by_material

_f = np.float32
_LOG2_E, _LN_2 = _f(1.4426950408889634), _f(0.6931471805599453)


@inlined
def _exp(x):
    """exp(x) for x from 0 to 80, relative error below 5e-6, without a call that would stop the vector unit."""
    n = np.int32(x * _LOG2_E + _f(0.5))
    r = x - _f(n) * _LN_2
    series = _f(1 / 6) + r * (_f(1 / 24) + r * (_f(1 / 120) + r * _f(1 / 720)))
    return (_f(1) + r * (_f(1) + r * (_f(0.5) + r * series))) * bits_float((n + np.int32(127)) << np.int32(23))


@inlined
def _add(floor, m_of_tag, clean, tag, unit, exponents, depth):
    """depth += floor·exp(m·clean)·unit where there is a return, for up to BLOCK pixels; exponents is scratch."""
    for i in range(depth.size):
        exponents[i] = min(m_of_tag[tag[i]] * clean[i], _f(80))
    for i in range(depth.size):
        noisy = depth[i] + floor * _exp(exponents[i]) * unit[i]
        # Where the noise would put the surface behind the camera, there is a hole.
        depth[i] = max(noisy, _f(0)) if depth[i] > _f(0) else _f(0)


@kernel
def _add_noise(start, stop, frame, key, floor, m_of_tag, clean, tag, depth):
    """Add noise that is drawn here; ``start`` is a multiple of BLOCK."""
    words, normals = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32)
    exponents = np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        normal_block(at // BLOCK, frame, 0, key, words, normals)
        # Slices, because an index that is plainly not negative is what lets the compiler use the vector unit.
        z, d, t = depth[at : min(at + BLOCK, stop)], clean[at : min(at + BLOCK, stop)], tag[at : min(at + BLOCK, stop)]
        _add(floor, m_of_tag, d, t, normals, exponents, z)


@kernel
def _add_given_noise(start, stop, floor, m_of_tag, clean, tag, noise, depth):
    """Add noise that was drawn before."""
    exponents = np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        end = min(at + BLOCK, stop)
        _add(floor, m_of_tag, clean[at:end], tag[at:end], noise[at:end], exponents, depth[at:end])


class MaterialNoise(Effect):
    """Gaussian noise with std = floor·exp(m·d), d the z-depth [m] and m the value of the material that was hit.

    Some materials may have more of it than others, at any range, by a factor 1 + gain.
    """

    id: ClassVar[str] = "material_noise"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = 3  # after those that make the other noise larger
    source: ClassVar[str] = (
        "section 2 of 'High-Fidelity Drone Simulation with Depth Camera Noise and Improved Air Drag Force Models'"
    )
    axes = ("material", "range")
    kinds = ("spread",)
    recording = "several materials, each at several ranges"
    law = "the basic noise"
    forms = ({"gain": {}}, {"m": {}})
    gain_of_material = "gain"

    floor: float = parameter(
        0.005,
        low=0,
        high=0.1,
        unit="m",
        neutral=0,
        about="standard deviation at zero range",
        source="0.005 m in the paper's law",
        frozen=True,
    )
    m: dict[str, Annotated[FiniteFloat, Field(ge=0, le=20)]] = by_material(
        about="m [1/m] of some tags, in place of materials.yaml's",
        unit="1/m",
        source="materials.yaml",
        step=0.02,
        likely=3.0,
    )

    gain: dict[str, Annotated[FiniteFloat, Field(ge=-0.99, le=100)]] = by_material(
        about="by how much the noise is more on some tags, as a share of it",
        unit="share",
        source="none by default",
        step=0.1,
        starts=(0.0, 3.0),
        likely=10.0,
    )

    @property
    def material_tags(self) -> tuple[str, ...]:
        """The tags that have values of their own here."""
        return tuple(dict.fromkeys((*self.m, *self.gain)))

    def apply(self, frame: Frame) -> None:
        """Add the noise to every return."""
        louder = any(self.gain.get(tag, 0.0) for tag in frame.scene.tags)
        m = frame.by_tag({tag: self.m.get(tag, frame.materials[tag].m) for tag in frame.scene.tags})
        clean, tag = frame.geometry.depth.reshape(-1), frame.geometry.tag.reshape(-1)
        floor, depth = _f(self.floor), frame.depth.reshape(-1)
        plain = frame.correlation == Correlation() and not frame.has_noise_gain and not louder
        if plain and not frame.keeps_noise:
            draws = frame.draws(self.id)
            # Numbers that are made where they are used save a pass over the memory.
            frame.run(_add_noise, draws.frame, draws.key, floor, m, clean, tag, depth, multiple=BLOCK)
        else:
            noise = frame.unit_noise(self.id).reshape(-1)
            if frame.has_noise_gain:
                noise *= frame.noise_gain.reshape(-1)
            if louder:
                noise *= frame.by_tag({tag: 1 + self.gain.get(tag, 0.0) for tag in frame.scene.tags})[tag]
            frame.run(_add_given_noise, floor, m, clean, tag, noise, depth)
