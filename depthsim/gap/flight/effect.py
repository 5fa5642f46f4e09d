"""What an effect of the flight is, and the registry of all of them.

The name of an effect says what happens physically; its candidates are several formulas for it, since nobody knows
which one a real vehicle follows. Its class says all that is to be known of it; nothing else has a list of effects. The
registry finds the classes in ``depthsim/gap/flight/effects/`` and those in the files that ``DEPTHSIM_EFFECTS``
names.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import ClassVar, Literal, get_args

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.flight.data.records import Need, Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.registry import check_words, load_own, load_package, with_ids

Values = Sequence[float]
Axis = Literal[
    "speed", "airspeed_direction", "thrust", "acceleration", "angular_rate", "altitude", "place", "time", "axis"
]
"""The axes that the diagnosis cuts a gap along."""
Family = Literal["drag", "wind", "scale", "rotors", "sensor", "other"]
"""Effects that can stand for one another or act by one another: forces by which a wind acts too, winds, the thrust of
all rotors together or of each, and errors of the accelerometer."""


@dataclass(frozen=True)
class Parameter:
    """A number that a candidate has. start: where a fit begins. step: for derivatives. low, high: what makes sense.

    shape: whether a value at the bounds makes sense too, as that of an exponent or a share does. neutral: where the
    effect is not there; ``start`` if not given. spare: whether it stays there unless the logs speak for another value.
    """

    name: str
    unit: str
    start: float
    step: float
    low: float = -np.inf
    high: float = np.inf
    shape: bool = False
    neutral: float | None = None
    spare: bool = False

    @property
    def nothing(self) -> float:
        """The value that changes nothing."""
        return self.start if self.neutral is None else self.neutral


@dataclass(frozen=True)
class Candidate:
    """One way to write an effect.

    apply: the settings with these values of the parameters. linear: whether the force is linear in them.
    columns: (n, C, A, P) its derivatives by the parameters, written into an array, where that is quicker than by
    differences. named: the parameters as a report has them, lists by name, where they are not those of the candidate.
    """

    effect: str
    name: str
    parameters: tuple[Parameter, ...]
    apply: Callable[[Settings, Values], Settings]
    linear: bool = True
    columns: Callable[[Records, Floats], Floats] | None = None
    named: Callable[[Values, Records, Settings], dict[str, list[float]]] | None = None

    def at_bound(self, values: Values) -> bool:
        """Whether a fit ended at a bound; 0, where an effect is not there, is none."""
        return any(
            not one.shape and (value >= one.high or (value <= one.low and one.low != 0))
            for one, value in zip(self.parameters, values, strict=True)
        )

    def holding(self, place: int) -> "Candidate":
        """The same with one parameter less, which stays where it changes nothing."""
        value = self.parameters[place].nothing

        def apply(s: Settings, v: Values) -> Settings:
            return self.apply(s, [*v[:place], value, *v[place:]])

        kept = (*self.parameters[:place], *self.parameters[place + 1 :])
        return replace(self, parameters=kept, apply=apply)

    @property
    def starts(self) -> list[float]:
        """Where a fit begins."""
        return [parameter.start for parameter in self.parameters]


class FlightEffect:
    """One physical effect of a flight. A subclass sets ``id``, ``title``, ``axes`` and has :meth:`candidates`."""

    id: ClassVar[str]
    title: ClassVar[str]
    """in words"""
    axes: ClassVar[tuple[Axis, ...]]
    """along which the gap that it makes changes, the one that shows it best first"""
    family: ClassVar[Family] = "other"
    needs: ClassVar[tuple[Need, ...]] = ()
    """what a log must have for it to be asked about"""
    rank: ClassVar[int] = 100
    """the order of the bank; of effects that do equally well the first goes first"""
    recording: ClassVar[str] = ""
    """what to do next where it was found, and nothing does as well"""
    apart: ClassVar[Mapping[str, str]] = {}
    """the flight that would distinguish it from another effect, by the other's id; enough in one of the two"""
    most_left: ClassVar[float | None] = None
    """the power over its own that may still be learned when it is fitted, where it is not as for all: more speaks
    against it"""

    @classmethod
    def candidates(cls, records: Records, base: Settings, radius: float) -> list[Candidate]:
        """The ways to write it that these logs can be asked about, those with fewer parameters first.

        base: the vehicle as it is known. radius: of a rotor [m].
        """
        raise NotImplementedError


@cache
def _registry() -> dict[str, type[FlightEffect]]:
    load_package("depthsim.gap.flight.effects")
    load_own()
    found = with_ids(FlightEffect, ("title", "axes"))
    for kind in found.values():
        check_words(kind, "axes", get_args(Axis))
        check_words(kind, "needs", get_args(Need))
    return dict(sorted(found.items(), key=lambda item: (item[1].rank, item[0])))


def flight_effect_ids() -> list[str]:
    """The ids of all effects, in the order of the bank."""
    return list(_registry())


def flight_effect(effect_id: str) -> type[FlightEffect]:
    """The effect of an id; KeyError where there is none."""
    return _registry()[effect_id]


def family_of(effect_id: str) -> Family:
    """The family of an effect."""
    return flight_effect(effect_id).family
