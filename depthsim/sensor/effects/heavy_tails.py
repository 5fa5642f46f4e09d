"""Depths that have nothing to do with the surface: false matches."""

from typing import ClassVar

import numpy as np

from depthsim.draws import BLOCK, uniform_block
from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_f = np.float32
_LEAST = _f(1e-6)


@kernel
def _mismatch(start, stop, frame, key, share, search, spread, disparity):
    words = np.empty(BLOCK, np.uint32)
    chance, place = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        uniform_block(at // BLOCK, frame, 0, key, words, chance)
        uniform_block(at // BLOCK, frame, 1, key, words, place)
        d = disparity[at : min(at + BLOCK, stop)]
        for i in range(d.size):
            u = min(max(place[i], _LEAST), _f(1) - _LEAST)
            off = spread * (_f(2) * u - _f(1)) / np.sqrt(_f(2) * u * (_f(1) - u))
            off = off if d[i] + off > _f(0) else -off
            false = d[i] + off if spread > _f(0) else search * place[i]
            false = false if chance[i] < share else d[i]
            d[i] = false if d[i] > _f(0) else _f(0)


class HeavyTails(Effect):
    """A share of the returns has a false disparity: uniform from 0 to ``search``, or its own plus ``spread`` · t.

    t is Student's with two degrees of freedom, (2u - 1) / √(2u (1 - u)) for a uniform u: false matches that lie near
    the right one, on its other side where there is no disparity. None is a hole.
    """

    id: ClassVar[str] = "heavy_tails"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = 9  # in place of the noisy disparity
    source: ClassVar[str] = "a false match may lie anywhere in the matcher's search range"
    axes = ("residual_tail",)
    kinds = ("tail", "spread")
    recording = "a flat wall away from any depth edge"
    forms = ({"spread": 0.0}, {"search": 126.0})
    outgrown: ClassVar = {"share": 0.5}  # of most pixels it is noise
    shown: ClassVar = {"share": 0.02}

    share: float = parameter(
        0.003,
        low=0,
        high=1,
        unit="share",
        neutral=0,
        about="share of the returns that are false",
        source="0.3 % of the floor is more than 1 px of disparity off in the D435 frames of aims-slam, but in a few "
        "patches, not in single pixels as here",
    )
    search: float = parameter(
        126,
        low=8,
        high=1024,
        unit="px",
        about="largest disparity that the matcher looks for",
        source="126 px: the nearest range of a D435 at 848x480 is f·b / 126 px",
        starts=(126, 25),
    )

    spread: float = parameter(
        0.0,
        low=0,
        high=50,
        unit="px",
        about="how far false disparities lie from the right one; 0: anywhere in the search range",
        source="none: a false match may lie anywhere",
        starts=(0.3, 3.0),
        scale="log",
    )

    def apply(self, frame: Frame) -> None:
        """Replace the drawn disparities."""
        draws, disparity = frame.draws(self.id), frame.disparity.reshape(-1)
        widths = _f(self.search), _f(self.spread)
        frame.run(_mismatch, draws.frame, draws.key, _f(self.share), *widths, disparity, multiple=BLOCK)
