"""Several threads on one numba kernel.

The kernels release the GIL, so plain Python threads do. numba's own threading layers are left alone: `workqueue`
breaks under several Python threads and the OpenMP layer spins against them. Results never depend on the number of
threads, because a kernel only ever writes the pixels of the range that it was given.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from queue import SimpleQueue


def core_count() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max_workers=max(4, core_count()), thread_name_prefix="depthsim")


if hasattr(os, "register_at_fork"):
    # A forked process (a data loader's worker, say) has the pool but none of its threads, and would wait for ever.
    os.register_at_fork(after_in_child=_pool.cache_clear)


def run_threads(work: Callable[[int], None], threads: int) -> None:
    """Call ``work(0)`` to ``work(threads - 1)`` at the same time; the caller's own thread does the first."""
    if threads == 1:
        return work(0)
    # A queue in C, not futures: Ctrl-C between a future's lock and its release would leave that lock held for ever.
    ended: SimpleQueue[tuple[int, BaseException | None]] = SimpleQueue()

    def told(index: int) -> None:
        error = None
        try:
            work(index)
        except BaseException as raised:
            error = raised
        ended.put((index, error))

    for index in range(1, threads):
        _pool().submit(told, index)
    try:
        work(0)
    finally:
        outcomes = dict(ended.get() for _ in range(1, threads))  # nobody goes on writing into the caller's arrays
    for index in range(1, threads):
        if (error := outcomes[index]) is not None:
            raise error


def split(kernel: Callable[..., None], size: int, threads: int, *arguments: object, multiple: int = 1) -> None:
    """Call ``kernel(start, stop, *arguments)`` on ``threads`` equal parts of ``range(size)``, cut at ``multiple``."""
    if threads == 1:
        if size:
            kernel(0, size, *arguments)
        return
    step = -(-size // (threads * multiple)) * multiple

    def work(index: int) -> None:
        start, stop = index * step, min((index + 1) * step, size)
        if start < stop:
            kernel(start, stop, *arguments)

    run_threads(work, threads)
