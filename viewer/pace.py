"""How many frames a browser takes: it is asked for an echo after each, and a cloud that is too much is thinned."""

import time
from collections import deque
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress

import viser

AIM = 10.0
"""[frames/s] The cloud is thinned until there are as many."""
FASTEST = 15.0
_LEVELS = (1, 2, 3, 4, 6, 8, 12, 16, 24, 32)
_ON_THEIR_WAY = 2
_LOOK = 6
"""Frames before the thinning is judged."""
_PATIENCE = 20.0
"""[s] before a cloud is tried again that was too much."""


class Echo:
    """Knows what the browser has taken in of what was sent.

    The next frame is worked out while one is drawn, and sent when that is done; to a browser that takes long, all the
    same after a while, and never so that more than two are on their way to it.
    """

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._pool = ThreadPoolExecutor(_ON_THEIR_WAY, thread_name_prefix="echo")
        self._under_way: deque[Future[None]] = deque()

    def ask(self) -> None:
        """Ask for an echo of all that was sent so far."""
        with suppress(RuntimeError):  # the pool is closed: the browser has gone
            self._under_way.append(self._pool.submit(self._wait))

    def _wait(self) -> None:
        # A value in the browser's own storage that is never there: the answer comes when the messages before are done.
        with suppress(RuntimeError, TimeoutError):
            self._client.local_storage.get_item("depthsim-echo", timeout=20)

    def back(self, timeout: float, on_their_way: int = _ON_THEIR_WAY - 1) -> bool:
        """Whether, within ``timeout`` [s], no more than so many frames are on their way."""
        end = time.monotonic() + timeout
        while len(self._under_way) > on_their_way:
            try:
                self._under_way[0].result(max(end - time.monotonic(), 0.0))
            except TimeoutError:
                return False
            self._under_way.popleft()
        return True

    def close(self) -> None:
        """Wait no more."""
        self._pool.shutdown(wait=False, cancel_futures=True)


class Pace:
    """Chooses how much a playing cloud is thinned, from the times at which frames were taken in."""

    def __init__(self) -> None:
        self._level, self._best, self._tried = 0, 0, -_PATIENCE
        self._times: list[float] = []
        self.rate: float | None = None

    @property
    def one_in(self) -> int:
        """1 in so many points."""
        return _LEVELS[self._level]

    def rest(self) -> None:
        """It does not play: what comes next says nothing about the last frames."""
        self._times = []
        self.rate = None

    def taken(self, most: float) -> None:
        """A frame was taken in. most: how many there are to be had [frames/s]."""
        aim, now = min(AIM, 0.9 * most), time.monotonic()
        self._times.append(now)
        if len(self._times) <= _LOOK:
            return
        self.rate = (len(self._times) - 1) / (now - self._times[0])
        self._times = [now]
        if self.rate < aim and self._level < len(_LEVELS) - 1:
            # Two levels at once where it is far off; never back to what was too much, until some time has gone by.
            self._level = min(self._level + (2 if self.rate < aim / 2 else 1), len(_LEVELS) - 1)
            self._best, self._tried = self._level, now
        elif self.rate > 1.25 * aim and self._level > 0 and (self._level > self._best or now - self._tried > _PATIENCE):
            self._level -= 1
            self._best, self._tried = min(self._best, self._level), now
