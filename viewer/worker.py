"""One thread that does the heavy work of one browser, so that no page ever waits: the latest wish of a kind wins."""

import atexit
import heapq
import sys
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass, field

from depthsim.errors import InputError

Job = Callable[[], None]


@dataclass(order=True)
class _Wish:
    due: float
    number: int
    kind: str = field(compare=False)
    job: Job = field(compare=False)


class Worker:
    """Does jobs one after another. A job that still waits when another of its kind is asked for is forgotten.

    told: called with the kind of a job before it begins and with None when it is done. ended: called with the kind of
    a job and "", or the one line that says why it could not be done.
    """

    def __init__(self, told: Callable[[str | None], None], ended: Callable[[str, str], None]) -> None:
        self._told, self._ended = told, ended
        self._wishes: list[_Wish] = []
        self._latest: dict[str, int] = {}
        self._changed = threading.Condition()
        self._number, self._open = 0, True
        self._thread = threading.Thread(target=self._work, name="viewer", daemon=True)
        self._thread.start()
        # A daemon thread is ended wherever it stands; inside the ray caster that takes the process down with it.
        atexit.register(self._finish)

    def ask(self, kind: str, job: Job, delay: float = 0.0) -> None:
        """Do ``job`` in ``delay`` [s], in place of an earlier one of its kind."""
        with self._changed:
            self._number += 1
            self._latest[kind] = self._number
            heapq.heappush(self._wishes, _Wish(time.monotonic() + delay, self._number, kind, job))
            self._changed.notify()

    def close(self) -> None:
        """Begin nothing more; what is under way is finished."""
        with self._changed:
            self._open = False
            self._changed.notify()

    def _finish(self) -> None:
        """Begin nothing more, and wait for what is under way."""
        self.close()
        self._thread.join()

    def _next(self) -> _Wish | None:
        """The next job when it is due; None at the end."""
        with self._changed:
            while self._open:
                while self._wishes and self._latest[self._wishes[0].kind] != self._wishes[0].number:
                    heapq.heappop(self._wishes)
                wait = self._wishes[0].due - time.monotonic() if self._wishes else None
                if wait is not None and wait <= 0:
                    return heapq.heappop(self._wishes)
                self._changed.wait(wait)
        return None

    def _work(self) -> None:
        while (wish := self._next()) is not None:
            self._told(wish.kind)
            line = ""
            try:
                wish.job()
            except InputError as error:
                line = str(error)
            except Exception as error:  # a fault of ours: the page goes on, the trace goes to whoever runs it
                if not self._open:
                    continue  # the browser has gone
                traceback.print_exc(file=sys.stderr)
                line = f"{wish.kind} failed: {type(error).__name__}: {error}"
            self._told(None)
            if self._open:
                self._ended(wish.kind, line)
        atexit.unregister(self._finish)
