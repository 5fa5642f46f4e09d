"""An effect that may be a cause, what the gap is without and with it, and what others explain of it."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.config import DepthAgreement
from depthsim.gap.depth.fit.changes import KINDS, Changes, Effects, worth_of
from depthsim.gap.depth.fit.traits import bends_rays
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import Effect
from depthsim.sensor.parameter import learned_of

WORDS = {"bias": "biases", "spread": "spreads", "missing": "holes", "tail": "tails", "all": "errors"}
"""The kinds of errors, for messages."""


@dataclass(frozen=True)
class Asked:
    """An effect that may be a cause. before: the others; gap, left: without and with it; does: what it changes.

    alone, flexible: see :func:`agreement.disagreement`. closes_well, nearly_all: whether it closes most of the gap, or
    nearly all. takes_away: whether it makes holes everywhere, as no other cause does, and ``before`` has more of it:
    how those change that the recording has is not for it to say. filled: of an effect that fills holes, what is left
    where there were too many.
    """

    validator: Validator
    effect: type[Effect]
    before: Effects
    gap: Changes
    left: Changes
    does: Changes
    alone: bool
    flexible: bool
    closes_well: bool
    takes_away: bool = False
    filled: float | None = None
    nearly_all: bool = False

    def of(self, gap: Changes, left: Changes) -> "Asked":
        """The same, asked for a part of the gap."""
        return replace(self, gap=gap, left=left)

    @property
    def limit(self) -> DepthAgreement:
        """The thresholds."""
        return self.validator.evidence.config.agreement

    @property
    def learned(self) -> bool:
        """Whether it is a pattern that is learned from the recording."""
        return bool(learned_of(self.effect))

    @property
    def makes_first(self) -> bool:
        """Whether no other kind of its errors is more than the first: sunlight on a far wall may lose pixels only."""
        made = [float(self.does.whole[KINDS.index(kind)]) for kind in self.effect.kinds if kind in KINDS]
        return self.effect.kinds[0] not in KINDS or made[0] == max(made)

    @property
    def own(self) -> NDArray[np.bool_]:
        """(axes,) whether it acts along an axis, or one of the two that are crossed."""
        return np.array([bool(axis.names & set(self.effect.axes)) for axis in self.validator.evidence.axes])

    @property
    def named(self) -> list[Effect]:
        """The causes named so far."""
        return [cause for cause in self.before if cause not in self.validator.evidence.base]

    def others(self, axis: int, k: int | None = None) -> list[Effect]:
        """The causes named so far that act along an axis, of one kind or of any.

        What a learned pattern leaves is due to no formula.
        """
        along = self.validator.evidence.axes[axis].names
        formulas = (cause for cause in self.named if not learned_of(type(cause)))
        return [one for one in formulas if along & set(one.axes) and (k is None or KINDS[k] in one.kinds)]

    def beside(self, k: int) -> int | None:
        """The axis along which a kind of gap changes most of those along which no other cause acts, or of the effect's
        own no other one of that kind; None where that is none of the effect's."""
        sure, worth = worth_of(self.validator, self.gap, k)
        theirs = [bool(self.others(n, k if own else None)) for n, own in enumerate(self.own)]
        axis = int(np.argmax(np.where(theirs, -np.inf, worth)))
        return axis if sure[axis] and self.own[axis] else None

    def along_own(self, k: int, otherwise: int) -> int:
        """The axis of the effect's own along which a kind of gap changes most, or another one if that is chance."""
        sure, worth = worth_of(self.validator, self.gap, k)
        axis = int(np.argmax(np.where(self.own & sure, worth, -np.inf)))
        return axis if sure[axis] and self.own[axis] else otherwise

    def surely_left(self, k: int, axis: int) -> float:
        """Share of how a kind of gap changes along an axis that is left beyond chance."""
        left = float(self.left.varies[k, axis] - self.limit.sure * self.left.chance[k, axis])
        return max(left, 0.0) / max(float(self.gap.varies[k, axis]), 1e-12)

    def change_along(self, k: int, axis: int) -> str:
        """What changes along which axis, in words."""
        return f"{WORDS[KINDS[k]]} change along {self.validator.evidence.axes[axis].name.replace('_', ' ')}"

    def is_seen_past_edges(self, axis: int) -> bool:
        """Whether an axis is the distance from edges, past which rays see that another cause bends by its own
        formula."""
        at_edges = "edge_distance" in self.validator.evidence.axes[axis].names
        return at_edges and any(bends_rays(cause.id) for cause in self.named)
