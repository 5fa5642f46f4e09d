"""The check of the measure: what a closed gap does to the figures, counted on diagnoses made up for it."""

import numpy as np
import pytest

from benchmarks.cost import by_figure, drawn, not_nearer, off_recording
from benchmarks.withheld_data.case import Wanted
from depthsim.gap import Diagnosis
from depthsim.gap.diagnosis import Gap, Interval, Task


def diagnosis(closed: float, *tasks: Task) -> Diagnosis:
    gap = Gap(measure="", unit="", before=1.0, after=1 - closed, floor=0.0, closed_fraction=closed, ci95=(0.0, 1.0))
    return Diagnosis(verdict="explained", gap=gap, where=(), causes=(), unexplained=None, tasks=tasks)


def task(name: str, before: float | None, after: float | None, off: Interval, off_after: Interval) -> Task:
    ends = {"before_off": off, "after_off": off_after}
    return Task(name=name, unit="", recording=2.0, before=before, after=after, ci95=ends)


def test_figures_are_counted_where_they_matter_and_listed_where_a_closed_gap_leaves_them_wrong() -> None:
    right = task("plane_rms", 1.0, 2.1, (-1.2, -0.8), (-0.1, 0.3))
    wrong = task("fill_rate", 1.8, 3.0, (-0.3, -0.1), (0.9, 1.1))
    chance = task("z_accuracy", 9.0, 9.0, (-20.0, 34.0), (-20.0, 34.0))
    none = task("hole_width", None, 1.0, (0.0, 0.0), (0.0, 0.0))
    offs = off_recording("one", diagnosis(0.9, right, wrong, chance, none))
    assert [off.task.name for off in offs] == ["plane_rms", "fill_rate", "z_accuracy"]
    assert {name: rest for name, *rest in by_figure(offs)} == {
        "fill_rate": [1, pytest.approx(0.1), pytest.approx(0.5), 0],
        "plane_rms": [1, pytest.approx(0.5), pytest.approx(0.05), 1],
    }
    assert [name for name, *_ in by_figure(offs, 0.4)] == ["plane_rms"]
    assert [off.task.name for off in not_nearer(offs)] == ["fill_rate"]
    assert not_nearer(off_recording("open", diagnosis(0.5, wrong))) == []


def test_a_case_that_moves_goes_a_metre() -> None:
    wanted = Wanted("a", ("fill_rate",), ("strong",), 4, 20, (120, 68))
    still, moving = (drawn(wanted, moving=way) for way in (False, True))
    ways = [np.diff(case.film.told(case.film.stamps).positions, axis=0) for case in (still, moving)]
    lengths = [np.linalg.norm(way, axis=1).sum() for way in ways]
    assert lengths[0] < 1 < lengths[1]
