"""What to record next: which flight would distinguish effects that these logs do not."""

from collections.abc import Sequence

from depthsim.gap.flight.effect import flight_effect


def advice(effect: str, others: Sequence[str]) -> str:
    """One or two sentences; empty where there is nothing to add."""
    own = flight_effect(effect)
    if not others:
        return own.recording
    found = [own.apart.get(other) or flight_effect(other).apart.get(effect, "") for other in others]
    flights = list(dict.fromkeys(sentence for sentence in found if sentence))
    return " ".join(flights or ["Fly at other speeds, heights and headings, with climbs and hard turns."])
