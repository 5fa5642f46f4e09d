"""Rows and columns at the border that have no depth, whatever is seen there."""

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from depthsim.draws import BLOCK, uniform_block
from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame
from depthsim.sensor.parameter import Setting

_MEASURED = "120 frames of a Kinect that are registered to its colour camera (TUM RGB-D, freiburg1_xyz, 640x480)"


@kernel
def _empty(start, stop, frame, key, share, width, rows, inside, depth):
    """rows: which of the picture they are; inside: the first and the last + 1 column, and row, with depth."""
    words, uniforms = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32)
    left, right, top, bottom = inside
    for at in range(start, stop, BLOCK):
        uniform_block(at // BLOCK, frame, 0, key, words, uniforms)
        z = depth[at : min(at + BLOCK, stop)]
        for i in range(z.size):
            row, u = divmod(at + i, width)
            is_inside = left <= u < right and top <= rows[row] < bottom
            z[i] = z[i] if is_inside or uniforms[i] >= share else np.float32(0)


class EmptyBorder(Effect):
    """No depth in some columns and rows at the border, as where it was resampled into another camera's picture."""

    id: ClassVar[str] = "empty_border"
    stage: ClassVar[Stage] = Stage.HOLES
    source: ClassVar[str] = f"measured on {_MEASURED}"
    axes = ("image_position", "image_column", "image_row")
    kinds = ("missing",)
    recording = "a wall at a middle range that fills the picture"
    exact = True

    left: int = parameter(3, low=0, high=4096, unit="px", about="columns on the left", source=_MEASURED, frozen=True)
    right: int = parameter(38, low=0, high=4096, unit="px", about="columns on the right", source=_MEASURED, frozen=True)
    top: int = parameter(34, low=0, high=4096, unit="px", about="rows at the top", source=_MEASURED, frozen=True)
    bottom: int = parameter(0, low=0, high=4096, unit="px", about="rows at the bottom", source=_MEASURED, frozen=True)
    share: float = parameter(
        1.0, low=0, high=1, unit="share", neutral=0, about="share of these pixels", source=_MEASURED, starts=(1.0, 0.9)
    )

    @property
    def is_neutral(self) -> bool:
        """Whether nothing is lost."""
        return self.share == 0 or not any((self.left, self.right, self.top, self.bottom))

    @classmethod
    def possible(cls, setting: Setting) -> bool:
        """Where the recording's frames have such a border."""
        return setting.border is not None

    @classmethod
    def forms_in(cls, setting: Setting) -> Sequence[Mapping[str, float]]:
        """The border that is counted in the recording."""
        sides = ("left", "right", "top", "bottom")
        return () if setting.border is None else (dict(zip(sides, setting.border, strict=True)),)

    def apply(self, frame: Frame) -> None:
        """Set the border's drawn pixels to 0."""
        camera, draws = frame.camera, frame.draws(self.id)
        inside = (self.left, camera.width - self.right, self.top, camera.whole.height - self.bottom)
        share, depth = np.float32(self.share), frame.depth.reshape(-1)
        frame.run(_empty, draws.frame, draws.key, share, camera.width, camera.rows, inside, depth, multiple=BLOCK)
