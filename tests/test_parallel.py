"""Threads cover a range once, and survive faults and forks."""

import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from depthsim.parallel import run_threads, split


@given(st.integers(0, 2000), st.integers(1, 40), st.sampled_from([1, 4, 256]))
def test_a_range_is_covered_once_and_cut_at_multiples(size: int, threads: int, multiple: int) -> None:
    counts = np.zeros(size, int)

    def kernel(start: int, stop: int, mark: int) -> None:
        assert start % multiple == 0 and start < stop <= size
        counts[start:stop] += mark

    split(kernel, size, threads, 1, multiple=multiple)
    assert (counts == 1).all()


def test_the_threads_run_at_the_same_time() -> None:
    meeting = threading.Barrier(4, timeout=20)
    run_threads(lambda _: meeting.wait() and None, 4)


@pytest.mark.parametrize("faulty", [0, 2])
def test_a_fault_in_a_thread_is_raised(faulty: int) -> None:
    def work(index: int) -> None:
        if index == faulty:
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        run_threads(work, 3)


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system cannot fork")
def test_a_forked_process_has_threads_of_its_own() -> None:
    script = """
import os, signal, sys, time
from depthsim.parallel import run_threads
run_threads(lambda _: time.sleep(0.05), 3)
time.sleep(0.2)  # until the threads wait for work
child = os.fork()
if child == 0:
    signal.alarm(30)  # ends what would wait for ever
    run_threads(lambda _: None, 3)
    os._exit(0)
sys.exit(os.waitpid(child, 0)[1] != 0)
"""
    subprocess.run([sys.executable, "-c", script], check=True)
