"""A gap that no effect of the bank explains: what it looks like, and where to begin with a new effect."""

import math
from collections.abc import Sequence

from depthsim.gap.depth.where.localize import Place
from depthsim.gap.diagnosis import Cut, Nearest, Unexplained
from depthsim.gap.report.words import place as place_in_words
from depthsim.gap.selection import nearest_in_words


def unexplained_by(
    places: Sequence[Place], cuts: tuple[Cut, ...], fraction: float, nearest: tuple[Nearest, ...]
) -> Unexplained:
    """What no cause explains, a ``fraction`` of the gap. places, cuts: where it lies; nearest: what is no cause."""
    text, most = describe(places, cuts) + nearest_in_words(nearest), best_learned(places)
    return Unexplained(fraction=fraction, where=cuts, description=text, learnable=most, nearest=nearest)


def describe(places: Sequence[Place], cuts: Sequence[Cut]) -> str:
    """The gap in plain words."""
    if not cuts:
        return "the gap is spread so thinly that no axis stands out"
    first = cuts[0]
    closes = best_learned(places)
    text = f"{first.text} for {place_in_words(first)}"
    if len(cuts) > 1 and cuts[1].what != first.what:
        text += f"; besides, {cuts[1].text} for {place_in_words(cuts[1])}"
    if closes < 0.005:
        return f"{text}. No correction learned along one axis would close any of it."
    return f"{text}. A correction learned along one axis would close at most {closes:.0%} of it."


def best_learned(places: Sequence[Place]) -> float:
    """The most that a correction learned along one axis closes."""
    return max((place.closes for place in places if not math.isnan(place.closes)), default=0.0)


def stub(cut: Cut) -> str:
    """The beginning of a new effect, to be filled in."""
    stage = {"bias": "DISPARITY", "missing": "MISSING", "correlation": "PROCESSING"}.get(cut.what, "NOISE")
    name = f"new_{cut.axis.replace(' x ', '_by_')}_{cut.what}"
    title = "".join(word.capitalize() for word in name.split("_"))
    return f'''class {title}(Effect):
    """{cut.text} ({place_in_words(cut)}): say here what the sensor does."""

    id: ClassVar[str] = "{name}"
    stage: ClassVar[Stage] = Stage.{stage}
    source: ClassVar[str] = "where the formula is from"

    strength: float = parameter(0.1, low=0, high=1, unit="1", neutral=0, about="what it does", source="measured")

    def apply(self, frame: Frame) -> None:
        """Change frame.depth or frame.disparity in place; frame.geometry has depth, cosine, tag and face."""
'''
