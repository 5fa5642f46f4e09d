"""The threads of a diagnosis: many frames of one sensor side by side, or many sensors."""

import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from queue import Empty, SimpleQueue
from typing import TypeVar

S = TypeVar("S")
T = TypeVar("T")


@dataclass
class _Unfinished:
    """How many items of one call of :meth:`Workers.side_by_side` are not done yet."""

    count: int
    lock: threading.Lock = field(default_factory=threading.Lock)

    def one_less(self) -> None:
        with self.lock:
            self.count -= 1


class Workers:
    """Some threads. Results do not depend on how many there are."""

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._pool = ThreadPoolExecutor(threads, thread_name_prefix="evidence")
        self._of_thread = threading.local()

    @property
    def _among(self) -> _Unfinished | None:
        """What the caller is one of, if it is an item of :meth:`side_by_side`."""
        return getattr(self._of_thread, "among", None)

    @property
    def free(self) -> int:
        """How many threads can have a part of the caller's work, its own among them."""
        among = self._among
        return self._threads if among is None else max(1, self._threads - among.count + 1)

    def each(self, work: Callable[[S], T], items: Iterable[S]) -> list[T]:
        """The results of ``work`` on each item, side by side on the threads that are free."""
        if self.free == 1:
            return [work(item) for item in items]
        if self._among is None:
            return list(self._pool.map(work, items))
        return self._with_others(work, list(items))

    def side_by_side(self, work: Callable[[S], T], items: Iterable[S]) -> Iterator[T]:
        """The results of ``work`` on each item, as they come, in order: whole sensors, each looked at on one thread.

        There is less to wait for than where two threads share the frames of each. Those that are left without an item
        at the end help with the last ones.
        """
        if self.free == 1 or self._among is not None:
            return map(work, items)
        items = list(items)
        unfinished = _Unfinished(len(items))

        def alone(item: S) -> T:
            self._of_thread.among = unfinished
            try:
                return work(item)
            finally:
                self._of_thread.among = None
                unfinished.one_less()

        return self._pool.map(alone, items)

    def _with_others(self, work: Callable[[S], T], items: list[S]) -> list[T]:
        """As :meth:`each`; the caller, a thread of the pool, does not wait for others to begin."""
        results: dict[int, T] = {}
        left: SimpleQueue[int] = SimpleQueue()
        for number in range(len(items)):
            left.put(number)

        def share() -> None:
            while True:
                try:
                    number = left.get_nowait()
                except Empty:
                    return
                results[number] = work(items[number])

        helpers = [self._pool.submit(share) for _ in range(min(self.free, len(items)) - 1)]
        try:
            share()
        finally:
            begun = [helper for helper in helpers if not helper.cancel()]
            errors = [helper.exception() for helper in begun]
        for error in errors:
            if error is not None:
                raise error
        return [results[number] for number in range(len(items))]
