"""One frame that is to be taken."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.scratch import Scratch
from depthsim.sensor.motion import Motion
from depthsim.sensor.noise_field import Fields


@dataclass(frozen=True)
class Exposure:
    """One frame to be taken. pose: (4, 4) camera to world. index, seed: the key of its random numbers. stamp: [s].

    motion: where the camera is, in time. scratch: memory for arrays that are done with when the frame is.
    fields: where the last pictures of noise are kept, for a frame that is taken by many sensors.
    """

    pose: NDArray[np.float64]
    motion: Motion
    seed: int | Seed = 0
    index: int = 0
    stamp: float = 0.0
    threads: int = 1
    scratch: Scratch = field(default_factory=Scratch)
    fields: Fields | None = None
