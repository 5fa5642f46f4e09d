"""What a frame is cast with: the poses and the rays, which the effects of pose and optics change."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.draws import Draws, Seed
from depthsim.scratch import Scratch
from depthsim.sensor.motion import Motion


@dataclass
class View:
    """The poses and rays of one frame, before it is cast.

    pose: camera to world, (4, 4), or (height, 4, 4) for a pose a row. rays: (2, height, width) float32, x and y of
    each pixel's ray at z = 1. Effects put new arrays in their place.
    stamp: when the frame was taken, by its own account [s]. rows: when each row was, (height,) [s], where they were not
    taken at once; objects that move are where they are then. motion: where the camera is, in time.
    scratch: memory for arrays that are done with when the frame is. is_random: whether an effect has drawn any numbers.
    """

    pose: NDArray[np.float64]
    rays: NDArray[np.float32]
    camera: Camera
    motion: Motion
    seed: int | Seed
    index: int
    stamp: float
    threads: int = 1
    scratch: Scratch = field(default_factory=Scratch)
    rows: NDArray[np.float64] | None = None
    is_random: bool = False

    def draws(self, name: str) -> Draws:
        """Random numbers of one effect."""
        self.is_random = True
        return Draws(self.seed, name, self.index, self.threads, self.scratch)
