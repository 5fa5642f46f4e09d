"""Holes anywhere: the paper's fill rate."""

from typing import ClassVar

import numpy as np

from depthsim.draws import BLOCK, uniform_block
from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame


@kernel
def _make_holes(start, stop, frame, key, rate, depth):
    words, uniforms = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        uniform_block(at // BLOCK, frame, 0, key, words, uniforms)
        z = depth[at : min(at + BLOCK, stop)]
        for i in range(z.size):
            z[i] = z[i] if uniforms[i] >= rate else np.float32(0)


class FillRate(Effect):
    """A share of the pixels, drawn independently, returns nothing."""

    id: ClassVar[str] = "fill_rate"
    stage: ClassVar[Stage] = Stage.HOLES
    source: ClassVar[str] = (
        "section 2 of 'High-Fidelity Drone Simulation with Depth Camera Noise and Improved Air Drag Force Models'"
    )
    axes = ()
    kinds = ("missing",)
    recording = "a frontal, matt, textured wall at a middle range"

    rate: float = parameter(
        0.01, low=0, high=1, unit="share", neutral=0, about="share of pixels set to 0", source="1 % in the paper"
    )

    def apply(self, frame: Frame) -> None:
        """Set the drawn pixels to 0."""
        draws = frame.draws(self.id)
        frame.run(_make_holes, draws.frame, draws.key, np.float32(self.rate), frame.depth.reshape(-1), multiple=BLOCK)
