"""How causes are selected and what is said of them: one set of rules for a depth sensor and for a flight.

They know no measure and no fit: what closes how much, and how sure that is, is given to them.
"""

from collections.abc import Callable, Collection, Sequence
from typing import Any, TypeVar

from depthsim.gap.config import DepthSelect, FlightSelect
from depthsim.gap.diagnosis import Nearest, Unexplained, Verdict

Limits = DepthSelect | FlightSelect
T = TypeVar("T")
Refuse = Callable[[str, float, str], None]
"""Hears of an effect that is no cause, the share of the gap that it closes, and why."""


class Refused(dict[str, Nearest]):
    """Effects that are no causes, with what each closed where it closed most, and why it is none."""

    def refuse(self, effect: str, closed: float, why: str) -> None:
        """Keep why an effect is no cause, by where it closed most."""
        if effect not in self or self[effect].closed_fraction < closed:
            self[effect] = Nearest(effect=effect, closed_fraction=closed, why_not=why)

    def nearest(self, named: Collection[str], limit: Limits) -> tuple[Nearest, ...]:
        """Those that come nearest, best first. named: effects that are causes after all."""
        some = [one for one in self.values() if one.effect not in named and one.closed_fraction >= limit.nearest]
        return tuple(sorted(some, key=lambda one: -one.closed_fraction)[: limit.most_nearest])


def nearest_in_words(nearest: Sequence[Nearest]) -> str:
    """A sentence on the first, to go on with; empty for none."""
    said = " Nearest is {0.effect}, which closes {0.closed_fraction:.0%}; it is no cause, as it {0.why_not}."
    return said.format(nearest[0]) if nearest else ""


def verdict_of(named: bool, unexplained: Unexplained | None) -> Verdict:
    """Of a gap: explained where what is left would be no gap. named: whether there are causes."""
    if not named:
        return "unexplained"
    return "explained" if unexplained is None else "partly_explained"


def closes_enough(gained: float, left: float, whole: float, faint: float, limit: Limits) -> bool:
    """Whether what a further cause closes is enough for a name: much of the whole gap, or most of what was left of it.

    How small it is beside the other causes does not count against it, but what is less than ``faint`` is no gap.
    """
    return gained >= faint and (gained >= limit.further * whole or gained >= limit.further_of_left * left)


def closes_enough_alone(gained: float, most: float, whole: float, limit: DepthSelect) -> bool:
    """Whether what a first cause closes is enough for a name: much of the gap, or some and no other comes near.

    most: what another one closes that might be named in its place.
    """
    share = gained / max(whole, 1e-12)
    return share >= limit.first or (share >= limit.first_apart and gained >= limit.first_apart_times * most)


def plainest(trials: Sequence[T], loss: Callable[[T], float], size: Callable[[T], Any], margin: float) -> T | None:
    """Of those that do as well as the best, within a margin, the one of the least size, such as how many parameters it
    has; None of none."""
    least = min(map(loss, trials), default=0.0)
    return min((trial for trial in trials if loss(trial) - least < margin), key=size, default=None)


def not_outdone(
    trials: Sequence[T], loss: Callable[[T], float], size: Callable[[T], int], kind: Callable[[T], str]
) -> list[T]:
    """Those than which no other of their kind is smaller and does as well."""

    def outdoes(one: T, other: T) -> bool:
        return kind(one) == kind(other) and size(one) < size(other) and loss(one) <= loss(other)

    return [trial for trial in trials if not any(outdoes(other, trial) for other in trials)]


def is_tie(worse_by: float, margin: float, most: float, surely: Callable[[], bool]) -> bool:
    """Whether what leaves more than a cause is indistinguishable from it: hardly more, or not so on all of the data.

    worse_by: what it leaves more; less than ``margin`` is no difference, ``most`` or more is one, however unsure.
    surely: whether blocks of the data agree that it leaves more.
    """
    return worse_by < margin or (worse_by < most and not surely())
