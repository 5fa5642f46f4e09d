"""The pictures of the frames before one, for effects that look back: made when they are asked for, and kept a while."""

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from depthsim.sensor.exposure import Exposure

Raw = NDArray[np.uint16]


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
        known = self.known(then)
        if known is None:
            known = self._take(then)
            if known is not None:
                self.keep(then, known)
        return known

    def known(self, exposure: Exposure) -> Raw | None:
        """(height, width) the picture of a frame, if it is kept. Not to be changed."""
        with self._lock:
            return self._kept.get(_key(exposure))

    def keep(self, exposure: Exposure, raw: Raw) -> None:
        """Keep a frame's picture, which nobody changes any more, in place of the one that was kept first."""
        with self._lock:
            self._kept[_key(exposure)] = raw
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)


def _key(e: Exposure) -> object:
    return e.index, e.stamp, e.seed, e.pose.tobytes()
