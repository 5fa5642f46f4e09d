"""Depths that have nothing to do with the surface: false matches."""

from typing import ClassVar

import numpy as np

from depthsim.kernels import kernel
from depthsim.sensor.draws import BLOCK, uniform_block
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_f = np.float32


@kernel
def _mismatch(start, stop, frame, key, share, search, disparity):
    words = np.empty(BLOCK, np.uint32)
    chance, place = np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        uniform_block(at // BLOCK, frame, 0, key, words, chance)
        uniform_block(at // BLOCK, frame, 1, key, words, place)
        d = disparity[at : min(at + BLOCK, stop)]
        for i in range(d.size):
            false = search * place[i] if chance[i] < share else d[i]
            d[i] = false if d[i] > _f(0) else _f(0)


class HeavyTails(Effect):
    """A share of the returns has a disparity drawn uniformly from 0 to ``search`` in place of its own."""

    id: ClassVar[str] = "heavy_tails"
    stage: ClassVar[Stage] = Stage.NOISE
    rank: ClassVar[int] = 9  # in place of the noisy disparity
    source: ClassVar[str] = "a false match may lie anywhere in the matcher's search range"

    share: float = parameter(
        0.003,
        low=0,
        high=1,
        unit="share",
        neutral=0,
        about="share of the returns that are false",
        source="0.3 % of the floor is more than 1 px of disparity off in the D435 frames of aims-slam",
    )
    search: float = parameter(
        126,
        low=8,
        high=1024,
        unit="px",
        about="largest disparity that the matcher looks for",
        source="126 px: the nearest range of a D435 at 848x480 is f·b / 126 px",
    )

    def apply(self, frame: Frame) -> None:
        """Replace the drawn disparities."""
        draws, disparity = frame.draws(self.id), frame.disparity.reshape(-1)
        frame.run(_mismatch, draws.frame, draws.key, _f(self.share), _f(self.search), disparity, multiple=BLOCK)
