"""What may be wrong with a vehicle's model: the formulas of every effect that the logs can be asked about."""

from collections.abc import Sequence

from depthsim.gap.flight.data.records import Records
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.effect import Candidate, FlightEffect, flight_effect, flight_effect_ids


def bank(records: Records, base: Settings, radius: float, without: Sequence[str] = ()) -> list[Candidate]:
    """The candidates that these logs can be asked about. radius: of a rotor [m]. without: effects that are left out."""
    kept = [kind for kind in _effects() if kind.id not in without and not records.lacks(kind.needs)]
    return [candidate for kind in kept for candidate in kind.candidates(records, base, radius)]


def left_out(records: Records) -> list[str]:
    """What the logs lack, and the effects that are left out for it, in sentences."""
    notes = []
    for text, needs in records.lacking:
        names = [kind.id for kind in _effects() if needs & set(kind.needs)]
        said = f"; left out: {', '.join(names)}" if names else ""
        notes.append(text + said)
    return notes


def _effects() -> list[type[FlightEffect]]:
    return [flight_effect(name) for name in flight_effect_ids()]
