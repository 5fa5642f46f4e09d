"""What a recording cannot show: effects that, as a typical camera has them, would change nothing in these frames."""

from collections.abc import Iterator, Sequence

import numpy as np

from depthsim.gap.depth.data.divergence import Ruler
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.simulate import LOCATING
from depthsim.gap.depth.fit.fitting import first_look
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.sensor.parameter import parameters_of


def unseen(evidence: Evidence, without: Sequence[str] = ()) -> tuple[str, ...]:
    """The ids of effects that the sensor lacks and the recording could not show, by simulations on its own frames.

    Nothing near enough, no edge, one material, a camera that stands still: whatever the reason, an effect at its
    default values then changes the simulated frames by less than chance does, and so it does where it is what one of
    several materials has more of.
    """
    ruler = Ruler.of(evidence.axes)
    blocks = first_look(evidence, ruler, evidence.base)

    def roots(effects: Sequence[Effect]) -> np.ndarray:
        return ruler.roots(evidence.total(effects, blocks))

    here = roots(evidence.base)
    again = ruler.roots(evidence.total(evidence.base, blocks, LOCATING[0]))
    chance = evidence.config.significance.faint * float(np.square(again - here).sum())
    there = {effect.id for effect in evidence.base}
    tags = [tag for number, tag in enumerate(evidence.scene.tags) if evidence.cuts.shown_tags[number] >= 0]

    def is_seen(name: str) -> bool:
        typical = ((*evidence.base, effect) for effect in _typical(effect_class(name), tags))
        return any(float(np.square(roots(effects) - here).sum()) > chance for effects in typical)

    others = [name for name in effect_ids() if name not in there and name not in without]
    return tuple(name for name, seen in zip(others, evidence.side_by_side(is_seen, others), strict=True) if not seen)


def _typical(kind: type[Effect], tags: Sequence[str]) -> Iterator[Effect]:
    """An effect at its default values, and as one of several materials has it."""
    yield kind()
    for one in parameters_of(kind).values():
        if one.by_material and len(tags) > 1 and isinstance(one.starts, Sequence):
            yield from (kind(**{one.name: {tag: one.starts[-1]}}) for tag in tags)


def in_words(names: Sequence[str]) -> str:
    """What to record for the effects that could not be seen."""
    wishes: dict[str, list[str]] = {}
    for name in names:
        wishes.setdefault(effect_class(name).recording, []).append(name)
    asked = "; ".join(f"{', '.join(effects)} (record {wish})" for wish, effects in wishes.items())
    return f"this recording cannot show, at a typical strength: {asked}"
