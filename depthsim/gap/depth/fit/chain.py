"""Causes found one after the other, and what was refused on the way."""

from collections import Counter
from dataclasses import dataclass, field

from depthsim.gap.config import DepthSelect
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.ties import Ties
from depthsim.gap.depth.fit.validate import Score
from depthsim.gap.diagnosis import Nearest
from depthsim.gap.selection import Refused


@dataclass
class Chain:
    """Causes found one after the other. looked, before: the leaders of each step, and the gap before it; refused: by
    effect, what it closed and why it is none; asked: how often it was refused, less one for each that was trusted
    since; dropped: effects that were causes until all of them were there; trusted: those taken for the moment.
    is_unfinished: whether something is left, and no further cause was looked for.

    ties: the equals of each cause; gap, score: with all of them, on the frames held out. config: of the selection.
    """

    config: DepthSelect
    score: Score
    gap: float
    model: Model | None = None
    looked: list[tuple[Trial, ...]] = field(default_factory=list)
    before: list[float] = field(default_factory=list)
    refused: Refused = field(default_factory=Refused)
    asked: Counter[str] = field(default_factory=Counter)
    dropped: set[str] = field(default_factory=set)
    trusted: list[str] = field(default_factory=list)
    ties: Ties = field(default_factory=dict)
    is_unfinished: bool = False

    def refuse(self, effect: str, closed: float, why: str) -> None:
        """Keep why an effect is no cause."""
        self.asked[effect] += 1
        self.refused.refuse(effect, closed, why)

    def trust(self, effect: str) -> None:
        """Take an effect for the moment. Beside it the others are asked once more: it may have been what they left."""
        self.trusted.append(effect)
        for name in self.asked:
            self.asked[name] -= 1

    def is_out(self, effect: str) -> bool:
        """Whether an effect was asked often enough: beside other causes, too, it does not act where the gap lies."""
        return effect in self.dropped or self.asked[effect] >= self.config.asked

    @property
    def named(self) -> tuple[str, ...]:
        """The causes."""
        return tuple(part.effect for part in self.model.parts) if self.model else ()

    @property
    def nearest(self) -> tuple[Nearest, ...]:
        """The effects that come nearest of those that are no causes."""
        return self.refused.nearest(self.named, self.config)
