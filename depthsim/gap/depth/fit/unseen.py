"""What a recording cannot show: effects that, as a typical camera has them, would change nothing in these frames."""

from collections.abc import Sequence

import numpy as np

from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.simulate import LOCATING
from depthsim.gap.depth.fit.fitting import first_look
from depthsim.sensor.effect import Effect, effect_class, effect_ids


def unseen(evidence: Evidence, without: Sequence[str] = ()) -> tuple[str, ...]:
    """The ids of effects that the sensor lacks and the recording could not show, by simulations on its own frames.

    Nothing near enough, no edge, one material, a camera that stands still: whatever the reason, an effect at its
    default values then changes the simulated frames by less than chance does.
    """
    ruler = Ruler.of(evidence.axes)
    blocks = first_look(evidence, ruler, evidence.base)

    def roots(effects: Sequence[Effect]) -> np.ndarray:
        return ruler.roots(evidence.total(effects, blocks))

    here = roots(evidence.base)
    again = ruler.roots(evidence.total(evidence.base, blocks, LOCATING[0]))
    chance = evidence.config.significance.faint * float(np.square(again - here).sum())
    there = {effect.id for effect in evidence.base}
    others = (name for name in effect_ids() if name not in there and name not in without)
    return tuple(
        name
        for name in others
        if float(np.square(roots((*evidence.base, effect_class(name)())) - here).sum()) <= chance
    )


def in_words(names: Sequence[str]) -> str:
    """What to record for the effects that could not be seen."""
    wishes: dict[str, list[str]] = {}
    for name in names:
        wishes.setdefault(effect_class(name).recording, []).append(name)
    asked = "; ".join(f"{', '.join(effects)} (record {wish})" for wish, effects in wishes.items())
    return f"this recording cannot show, at a typical strength: {asked}"
