"""What the matcher does to the fraction of a disparity: a periodic bias, and steps."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from depthsim.kernels import inlined, kernel
from depthsim.sensor.effect import Effect, Setting, Stage, parameter
from depthsim.sensor.frame import Frame

_f = np.float32
_TWO_PI = _f(2 * np.pi)
_FINEST = 1e-5
"""The finest step [px] that float32 can distinguish from none."""


@inlined
def _sine(turns):
    """sin(2π·turns), error below 2e-6, without a call that would stop the vector unit."""
    x = turns - np.floor(turns + _f(0.5))
    x = _f(0.5) - x if x > _f(0.25) else x
    x = _f(-0.5) - x if x < _f(-0.25) else x
    a = x * _TWO_PI
    z = a * a
    return a * (_f(1) + z * (_f(-1 / 6) + z * (_f(1 / 120) + z * (_f(-1 / 5040) + z * _f(1 / 362880)))))


@kernel
def _add_bias(start, stop, amplitude, phase, disparity):
    d = disparity[start:stop]
    for i in range(d.size):
        biased = max(d[i] - amplitude * _sine(d[i] - phase), _f(0))
        d[i] = biased if d[i] > _f(0) else _f(0)


@kernel
def _add_harmonics(start, stop, amplitude, second, third, phase, disparity):
    d = disparity[start:stop]
    for i in range(d.size):
        turns = d[i] - phase
        sines = _sine(turns) + second * _sine(_f(2) * turns) + third * _sine(_f(3) * turns)
        d[i] = max(d[i] - amplitude * sines, _f(0)) if d[i] > _f(0) else _f(0)


@kernel
def _round_to_steps(start, stop, step, per_step, before, after, disparity):
    d = disparity[start:stop]
    for i in range(d.size):
        steps = np.floor(d[i] * per_step + before) + after
        d[i] = steps * step if (d[i] > _f(0)) & (steps > _f(0)) else _f(0)


class SubpixelBias(Effect):
    """d - amplitude · sin(2π·(d - phase)): sub-pixel interpolation draws disparities to ``phase`` + whole pixels.

    Parabolas have harmonics, too: amplitude · (second · sin(4π·(d - phase)) + third · sin(6π·(d - phase))).
    """

    id: ClassVar[str] = "subpixel_bias"
    stage: ClassVar[Stage] = Stage.DISPARITY
    rank: ClassVar[int] = 2
    source: ClassVar[str] = (
        "A. Grunnet-Jepsen et al., Intel white paper 'Subpixel Linearity Improvement for Intel RealSense Depth Camera "
        "D400 Series'; three sines in place of its measured curves"
    )
    axes = ("disparity_phase", "range")
    kinds = ("bias", "spread")
    recording = "a wall that is left slowly, so that the disparity passes through many whole pixels"
    forms = ({"second": 0.0, "third": 0.0}, {})

    amplitude: float = parameter(
        0.01,
        low=0,
        high=0.5,
        unit="px",
        neutral=0,
        about="largest bias",
        source="first Fourier term over the fraction of the disparity in the D435 frames of aims-slam",
        starts=(0.03,),
    )
    phase: float = parameter(
        0.0,
        low=-0.5,
        high=0.5,
        unit="px",
        about="fraction that disparities are drawn to",
        source="assumed: whole pixels; an offset of the disparity moves it",
        starts=(-0.25, 0, 0.25, 0.5),
    )
    second: float = parameter(
        0.0,
        low=-1,
        high=1,
        unit="share",
        about="of the amplitude, at twice the frequency",
        source="none by default; -0.13 for a parabola through sums of absolute differences",
        starts=(0.0,),
    )
    third: float = parameter(
        0.0,
        low=-1,
        high=1,
        unit="share",
        about="the same at three times the frequency",
        source="none by default; 0.06 for the same",
        starts=(0.0,),
    )

    def apply(self, frame: Frame) -> None:
        """Bias every disparity."""
        amplitude, phase, disparity = _f(self.amplitude), _f(self.phase), frame.disparity.reshape(-1)
        if self.second or self.third:
            frame.run(_add_harmonics, amplitude, _f(self.second), _f(self.third), phase, disparity)
        else:
            frame.run(_add_bias, amplitude, phase, disparity)


class DisparityQuantization(Effect):
    """The disparity is rounded to whole multiples of ``step``, halves up.

    Other cameras' steps may begin elsewhere, or be cut off: (⌊d/step - origin + (1 - down)/2⌋ + origin)·step. A fit
    tries both, and nothing between: what is off by less or more is an offset of the disparity.
    """

    id: ClassVar[str] = "disparity_quantization"
    # After the noise and after the mixing at edges: the chip's disparities, in-between ones too, are whole steps.
    stage: ClassVar[Stage] = Stage.MIXING
    rank: ClassVar[int] = 9
    source: ClassVar[str] = (
        "Intel white paper 'Subpixel Linearity Improvement for Intel RealSense Depth Camera D400 Series': 1/32 px"
    )
    axes = ("disparity_phase", "range", "pixel_neighbours", "residual_tail")
    kinds = ("spread", "bias", "correlation", "tail")
    recording = "a slanted wall far away, where one step of the disparity is wide"
    forms = ({"origin": 0.0, "down": 0.0}, {"down": 0.0}, {"origin": 0.0, "down": 1.0})

    step: float = parameter(
        1 / 32,
        low=0,
        high=4,
        unit="px",
        neutral=0,
        about="smallest difference of two disparities",
        source="exactly 1/32 px in the D435 frames of aims-slam; five fractional bits in librealsense, "
        "src/proc/disparity-transform.h",
        starts=(0.03, 0.12, 0.5),
    )
    origin: float = parameter(
        0.0,
        low=-0.5,
        high=0.5,
        unit="step",
        about="where the steps begin",
        source="0 in the same frames",
        starts=(-0.3, 0.3),
    )
    down: float = parameter(
        0.0,
        low=-1,
        high=1,
        unit="1",
        about="0: to the nearest step, 1: to the one below, -1: above",
        source="the same",
        frozen=True,
    )

    @classmethod
    def forms_in(cls, setting: Setting) -> Sequence[Mapping[str, float]]:
        """The steps that the recording's disparities have, if they have any: no fit finds them as finely."""
        if setting.steps is None:
            return cls.forms
        return [{"origin": setting.steps[1], "down": down} for down in (0.0, 1.0)]

    @classmethod
    def bounds_in(cls, setting: Setting) -> Mapping[str, tuple[float, float]]:
        """Their width, likewise."""
        return {} if setting.steps is None else {"step": (setting.steps[0], setting.steps[0])}

    def apply(self, frame: Frame) -> None:
        """Round every disparity."""
        step, before = max(self.step, _FINEST), (1 - self.down) / 2 - self.origin
        frame.run(_round_to_steps, _f(step), _f(1 / step), _f(before), _f(self.origin), frame.disparity.reshape(-1))
