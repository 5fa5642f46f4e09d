"""What recording would distinguish effects that explain the one at hand equally well."""

from collections.abc import Sequence

from depthsim.sensor.effect import effect_class


def advice_for(effect: str, ties: Sequence[str]) -> str:
    """The recording that would break a tie; empty without one."""
    if not ties:
        return ""
    wishes = list(dict.fromkeys(effect_class(name).recording for name in (effect, *ties)))
    return f"to distinguish {effect} from {', '.join(ties)}, record " + "; and ".join(wishes[:3])
