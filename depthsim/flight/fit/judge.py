"""How well a law does on flights it was not fitted on, and which laws do equally well."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from depthsim.flight.fit.sums import Sums, solve
from depthsim.flight.table import Floats

START_BLOCKS = 2
"""The offset "from the start" of a held-out flight is found on so many blocks, which then do not count."""
_MOST_SPLITS = 66
_ALIKE = 0.01
"""Laws whose held-out errors differ by less than this share are a tie, however sure the difference is."""
_LATERAL = slice(0, 2)


@dataclass(frozen=True)
class Score:
    """RMSE of the lateral specific force [m/s²] over the splits."""

    mean: float
    worst: float


@dataclass(frozen=True)
class Judgement:
    """One law on unseen flights, by what is known there of the offset between the accelerometer and the model.

    removed: it is taken out, from the whole held-out flight. start: it is found on the first five seconds in the air
    and the rest counts; None where flights are too short. kept: nothing is known, the offset counts as error.
    squares: per block, the squared residuals with the offset removed, each flight left out in its turn.
    by_split: the error with the offset removed, by the numbers of the flights left out (tests count on from there).
    """

    by_split: dict[tuple[int, ...], float]
    removed: Score
    start: Score | None
    kept: Score
    squares: tuple[Floats, ...]

    @property
    def splits(self) -> int:
        """How many ways to leave flights out were tried."""
        return len(self.by_split)


def judge(flights: Sequence[Sums], tests: Sequence[Sums] = ()) -> Judgement:
    """Fit on some flights, test on others.

    flights, tests: block sums. With ``tests`` there is one split; else every two flights are left out once, or every
    single one of fewer than four. There must be two flights, or a test.
    """
    everything = [*flights, *tests]
    totals = Sums.stacked([flight.total() for flight in everything])
    count = len(flights)
    if tests:
        splits = [tuple(range(count, count + len(tests)))]
        alone = splits
    else:
        splits = list(combinations(range(count), 2 if count >= 4 else 1))
        splits = [
            splits[index] for index in np.linspace(0, len(splits) - 1, min(len(splits), _MOST_SPLITS)).astype(int)
        ]
        alone = [(index,) for index in range(count)]

    def fitted(out: Sequence[int]) -> Floats:
        return solve(totals[np.array([index for index in range(count) if index not in out])])

    found: dict[str, list[float]] = {"removed": [], "start": [], "kept": []}
    for out in splits:
        theta = fitted(out)
        errors = [_errors(everything[index], theta) for index in out]
        for name, values in found.items():
            squares, samples = np.sum([error[name] for error in errors], axis=0)
            values.append(float(np.sqrt(squares / samples)) if samples else np.nan)
    squares = []
    for out in alone:
        theta = fitted(out)
        for index in out:
            nuisance = everything[index].total().nuisance(theta)
            squares.append(everything[index].squares(theta, nuisance)[:, _LATERAL].sum(axis=1))
    scores = {name: Score(float(np.mean(values)), float(np.max(values))) for name, values in found.items()}
    start = scores["start"] if np.isfinite(scores["start"].mean) else None
    by_split = dict(zip(splits, found["removed"], strict=True))
    return Judgement(by_split, scores["removed"], start, scores["kept"], tuple(squares))


def tied(one: Judgement, other: Judgement) -> bool:
    """Whether the data do not decide which of two laws is better.

    The paired difference of their squared errors is zero within 95 %, over blocks of time or, from five flights on,
    over flights; or the errors differ by less than 1 %.
    """
    from scipy.special import stdtrit

    if abs(one.removed.mean - other.removed.mean) <= _ALIKE * min(one.removed.mean, other.removed.mean):
        return True
    differences = [mine - theirs for mine, theirs in zip(one.squares, other.squares, strict=True)]
    for units in (np.concatenate(differences), np.array([flight.sum() for flight in differences])):
        if len(units) >= 5:
            half = stdtrit(len(units) - 1, 0.975) * units.std(ddof=1) / np.sqrt(len(units))
            if abs(units.mean()) <= half:
                return True
    return False


def _errors(flight: Sums, theta: Floats) -> dict[str, tuple[float, float]]:
    """Sum of squares and samples over the lateral axes, for each way to treat the offset."""
    total = flight.total()
    lateral = float(total.n[_LATERAL].sum())

    def squares(sums: Sums, nuisance: Floats) -> float:
        return float(sums.squares(theta, nuisance)[_LATERAL].sum())

    found = {
        "removed": (squares(total, total.nuisance(theta)), lateral),
        "kept": (squares(total, np.zeros_like(total.zy)), lateral),
        "start": (0.0, 0.0),
    }
    if len(flight) >= 2 * START_BLOCKS:
        head, rest = flight[:START_BLOCKS].total(), flight[START_BLOCKS:].total()
        found["start"] = (squares(rest, head.nuisance(theta)), float(rest.n[_LATERAL].sum()))
    return found
