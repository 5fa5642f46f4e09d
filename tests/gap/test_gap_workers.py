"""The threads of a diagnosis: every result once and in order, whoever helps whom."""

import threading
from time import sleep

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from depthsim.gap.depth import diagnose
from depthsim.gap.depth.data.workers import Workers


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_results_come_in_order_and_once(threads: int) -> None:
    workers = Workers(threads)
    done: list[int] = []

    def sensor(item: int) -> list[int]:
        return workers.each(lambda frame: (done.append(item * 100 + frame), item * 100 + frame)[1], range(7))

    assert list(workers.side_by_side(sensor, range(9))) == [[i * 100 + k for k in range(7)] for i in range(9)]
    assert sorted(done) == [i * 100 + k for i in range(9) for k in range(7)]
    assert workers.each(str, range(20)) == [*map(str, range(20))]


def test_a_thread_without_an_item_of_its_own_helps_with_the_last_one() -> None:
    workers, helped = Workers(2), threading.Event()

    def last(item: int) -> set[int]:
        if item == 0:
            return set()
        while workers.free == 1:
            sleep(0.001)

        def frame(number: int) -> int:  # two frames wait for each other, so that one thread alone would wait for ever
            if number == 0:
                assert helped.wait(20)
            helped.set()
            return threading.get_ident()

        return set(workers.each(frame, [0, 1]))

    assert [len(threads) for threads in workers.side_by_side(last, [0, 1])] == [0, 2]


def test_an_error_of_who_helps_is_told() -> None:
    workers = Workers(3)

    def frame(number: int) -> int:
        if number == 5:
            raise ValueError("frame 5")
        return number

    def sensor(item: int) -> list[int]:
        while workers.free == 1:
            sleep(0.001)
        return workers.each(frame, range(8))

    with pytest.raises(ValueError, match="frame 5"):
        list(workers.side_by_side(sensor, [0]))
    assert workers.each(str, [1, 2]) == ["1", "2"]  # and the next call finds all threads free
    assert workers.free == 3


def test_linear_algebra_of_a_diagnosis_has_one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    def threads() -> set[int]:
        return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}

    def load(*_: object) -> None:
        raise LookupError(threads())

    monkeypatch.setattr(diagnose, "load_evidence", load)
    with threadpool_limits(limits=2, user_api="blas"):
        if threads() != {2}:
            pytest.skip("this machine's linear algebra has one thread at most")
        with pytest.raises(LookupError) as found:
            diagnose.investigate("run")
        assert found.value.args == ({1},)
        assert threads() == {2}
