"""The pictures of the frames before one, for effects that look back: made when they are asked for, and kept a while."""

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from depthsim.sensor.exposure import Exposure

Raw = NDArray[np.uint16]
Made = TypeVar("Made", Raw, Raw | None)


class Past:
    """Pictures in whole units, as they are before anything is done to the finished picture. Safe on many threads.

    take: makes the picture of a frame; None where there is none. Each depends on nothing but its exposure, so it does
    not matter which are kept.
    rate: of the camera [Hz]. most: so many pictures are kept.
    """

    def __init__(self, take: Callable[[Exposure], Raw | None], rate: float, most: int) -> None:
        self._take, self._rate, self._most = take, rate, most
        self._kept: OrderedDict[object, Raw] = OrderedDict()
        self._lock = threading.Lock()

    def picture(self, now: Exposure, back: int) -> Raw | None:
        """(height, width) the frame that is ``back`` before another one; or None. Not to be changed."""
        if now.index < back:
            return None
        stamp, pose = now.motion.frame(now.index, now.stamp, back, self._rate)
        then = replace(now, index=now.index - back, stamp=stamp, pose=pose, scratch=now.scratch.inner())
        return self.of(then, self._take)

    def of(self, exposure: Exposure, take: Callable[[Exposure], Made]) -> Raw | Made:
        """(height, width) the picture of a frame as it is kept, or as ``take`` makes it. Not to be changed."""
        with self._lock:
            known = self._kept.get(_key(exposure))
        if known is None:
            known = take(exposure)
            if known is not None:
                self.keep(exposure, known)
        return known

    def keep(self, exposure: Exposure, raw: Raw) -> None:
        """Keep a frame's picture, which nobody changes any more, in place of the one that was kept first."""
        with self._lock:
            self._kept[_key(exposure)] = raw
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)


def _key(e: Exposure) -> object:
    return e.index, e.stamp, e.seed, e.pose.tobytes()
