"""The driver's filter in time."""

from itertools import chain
from typing import ClassVar

import numpy as np

from depthsim.kernels import inlined, kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame

_f, _i = np.float32, np.int32
_ZERO = _f(0)
_FORGOTTEN = 0.01
"""The weight below which a frame is left out of the average."""
_LEAST, _MOST = 8, 32
"""Frames that are looked back at: persistence asks for 8; more than so many are not worth their time."""
_SEEN = ((9, 8), (8, 8), (2, 3), (2, 4), (2, 8), (1, 2), (1, 5), (1, 8), (0, 8))
"""By persistence: so many of the last so many frames must have depth. The first is never."""


@inlined
def _count(bits):
    """How many of eight bits are set."""
    pairs = _i(bits - ((bits >> _i(1)) & _i(0x55)))
    fours = _i((pairs & _i(0x33)) + ((pairs >> _i(2)) & _i(0x33)))
    return _i((fours + (fours >> _i(4))) & _i(0x0F))


@kernel
def _follow(start, stop, alpha, delta, least, recent, picture, state, seen):
    """One frame. state: the filtered picture so far. seen: of the last 8 frames which had one, bit 7 the last."""
    d, s, history = picture[start:stop], state[start:stop], seen[start:stop]
    keep, recent, least = _f(1) - alpha, _i(recent), _i(least)
    for i in range(d.size):
        here, before, bits = d[i], s[i], _i(history[i])
        # One choice a line, see kernel.
        goes_on = abs(here - before) < delta
        mean = alpha * here + keep * before if goes_on else here
        mean = mean if before > _ZERO else here
        with_it = _i((bits >> _i(1)) | _i(128)) if goes_on else _i(128)
        with_it = with_it if before > _ZERO else _i(128)
        filled = before if _count(_i(bits & recent)) >= least else here
        filled = filled if before > _ZERO else here
        d[i] = mean if here > _ZERO else filled
        s[i] = mean if here > _ZERO else before
        history[i] = np.uint8(with_it if here > _ZERO else _i(bits >> _i(1)))


class TemporalFilter(Effect):
    """The driver's filter in time: d' = alpha·d + (1 - alpha)·d'₋₁, of the frame before, where they differ by less.

    d is the disparity. Where it differs by ``delta`` or more the average begins anew. A hole gets the last d' if enough
    of the last frames had depth there, by ``persistence``: 0 never, 1 all of 8, 2 two of 3, 3 two of 4, 4 two of 8, 5
    one of 2, 6 one of 5, 7 one of 8, 8 always.

    A frame is made from those before it down to a weight of 1 %, at least 8 and at most 32 (alpha below 0.14), and so
    depends on no other; the driver's own average, and its persistence of 8, have no end.
    """

    id: ClassVar[str] = "temporal_filter"
    stage: ClassVar[Stage] = Stage.PROCESSING
    rank: ClassVar[int] = 1
    source: ClassVar[str] = "librealsense, src/proc/temporal-filter.cpp and doc/post-processing-filters.md"
    axes = ("frame_neighbours", "motion")
    kinds = ("correlation", "spread", "missing")
    recording = "a camera that stands still and one that moves, with the camera's filters off and on"
    seen_on = ("disparity_noise",)
    forms = (
        {"persistence": 3, "depth_delta": 0.0},
        {"persistence": 0, "depth_delta": 0.0},
        {"persistence": 3, "delta": 20 / 32},
        {"persistence": 0, "delta": 20 / 32},
    )

    alpha: float = parameter(
        0.4,
        low=0.05,
        high=1,
        unit="1",
        neutral=1,
        about="weight of the frame itself",
        source="librealsense's default",
        starts=(0.4, 0.9),
    )
    delta: float = parameter(
        20 / 32,
        low=0,
        high=16,
        unit="px",
        about="step of the disparity that is no noise",
        source="librealsense's default, 20 steps of 1/32 px",
        starts=(4 / 32, 20 / 32, 4),
        scale="log",
    )
    depth_delta: float = parameter(
        0.0,
        low=0,
        high=2,
        unit="m",
        about="above 0, depth is filtered in place of disparity, and this is the step that is no noise",
        source="librealsense without its disparity transform, whose delta is in units of depth then",
        starts=(0.1,),
        scale="log",
    )
    persistence: int = parameter(
        3,
        low=0,
        high=8,
        unit="1",
        neutral=0,
        about="which holes are filled",
        source="librealsense's default",
        frozen=True,
    )

    @property
    def is_neutral(self) -> bool:
        """Whether it neither smooths nor fills."""
        return self.alpha == 1 and self.persistence == 0

    @property
    def looks_back(self) -> int:
        """So many that what is left out has a weight of 1 %."""
        frames = np.log(_FORGOTTEN) / np.log(1 - self.alpha) if self.alpha < 1 else 0
        return int(np.clip(np.ceil(frames), _LEAST, _MOST))

    def apply(self, frame: Frame) -> None:
        """Filter the frames before and then this one."""
        least, of = _SEEN[self.persistence]
        recent = (0xFF << (8 - of)) & 0xFF
        state, seen = frame.empty(), frame.empty(np.uint8)
        state.fill(0)
        seen.fill(0)
        delta = _f(self.depth_delta or self.delta)
        for one in chain(frame.earlier(self.looks_back), [frame]):
            picture = one.depth if self.depth_delta else one.disparity
            arrays = picture.reshape(-1), state.reshape(-1), seen.reshape(-1)
            one.run(_follow, _f(self.alpha), delta, least, recent, *arrays)
