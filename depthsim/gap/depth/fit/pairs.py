"""What an effect must not do to how errors go together from pixel to pixel: each rule gives the reason, or None."""

import numpy as np

from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.fit.along import lies_by_its_axis
from depthsim.gap.depth.fit.asked import Asked
from depthsim.gap.depth.fit.changes import ALL, KINDS, done_by, worth_of
from depthsim.gap.depth.fit.itself import known_by
from depthsim.gap.depth.fit.traits import is_filter
from depthsim.sensor.pipeline import all_of

PLACES = {"image_position", "image_row", "image_column", "surface"}
"""Axes along which whatever is in a scene has a place, where the camera hardly moves."""
INDEPENDENT = "adds errors that are independent, where those of the recording go together"


def of_pairs(asked: Asked) -> str | None:
    """Whether an effect that makes errors go together leaves too much of how they do."""
    left = left_of_pairs(asked)
    return f"leaves {left:.0%} of how errors go together" if left > asked.limit.left_along else None


def smooths_elsewhere(asked: Asked) -> str | None:
    """Whether an effect that makes errors go together, and their spread less by that, leaves how that changes.

    What a filter smooths it smooths everywhere but near edges; another formula leaves much there. Where edges lie in
    the picture is no other axis: a camera that hardly moves has them at one place. Beside another filter, what is left
    of how spreads change is by either's formula.
    """
    k, gap = KINDS.index("spread"), asked.gap
    if KINDS[k] not in asked.effect.kinds or any(is_filter(cause.id) for cause in asked.named):
        return None
    sure, worth = worth_of(asked.validator, gap, k)
    places = [bool(axis.names & PLACES) for axis in asked.validator.evidence.axes]
    first = int(np.argmax(np.where(places, -np.inf, worth)))
    if not sure[first] or gap.varies[k, first] <= asked.limit.uniform * gap.whole[k] or asked.others(first):
        return None
    share = asked.surely_left(k, first)
    if share <= asked.limit.left_along or "edge_distance" in asked.validator.evidence.axes[first].names:
        return None
    return f"leaves {share:.0%} of how {asked.change_along(k, first)}"


def left_of_pairs(asked: Asked) -> float:
    """Share that an effect leaves of how errors go together along its own axes."""
    axes = asked.validator.evidence.axes
    own = [n for n, axis in enumerate(axes) if axis.name in asked.effect.axes and axis.kind != histograms.ERROR]
    return float(asked.left.pairs[own].sum()) / max(float(asked.gap.pairs[own].sum()), 1e-12)


def goes_together(asked: Asked) -> str | None:
    """Whether errors that an effect makes one by one go together in the recording, and no other cause makes them so.

    Biases are the same for neighbours, those of a pattern that is learned as smooth as it is, and so is geometry. Holes
    are asked for holes: that the errors between them go together says nothing of them; and those of what is too near go
    together by themselves. Outliers are held against their own part of what an effect does, as patches of them, such as
    bands of an older picture, go together less than noise. And holes that lie by the effect's own axis and by nothing
    else are its own, be they in patches. In pictures that are resampled all errors go together, and how far is for the
    formula of that.
    """
    smooth = asked.effect.kinds[0] == "bias" or asked.effect.exact
    resampled = any(one.resizes() for one in all_of(asked.validator.evidence.camera, asked.before))
    if not asked.alone or smooth or resampled or any(cause.kinds[0] == "correlation" for cause in asked.named):
        return None
    kind, does, limit = asked.effect.kinds[0], asked.does.whole, asked.limit
    missing = KINDS.index("missing")
    if "missing" in asked.effect.kinds and does[missing] >= does[:ALL].max():
        kind = "missing"
    if kind == "missing" and _lie_by_their_axis(asked, missing):
        return None
    together = asked.left.lost_together if kind == "missing" else asked.left.together
    as_tails = kind == "tail" and not lies_by_its_axis(asked)
    most = limit.outliers_together * does[KINDS.index(kind)] if as_tails else limit.together * does[ALL]
    if kind == "missing":
        if asked.does.lost_together > most:
            return None
        most = max(most, limit.left_along * _made_together(asked))
    return INDEPENDENT if together > most else None


def _lie_by_their_axis(asked: Asked, k: int) -> bool:
    """Whether nothing is left of how a kind of gap changes along the axis that an effect is known by, nor along the one
    along which it changes most."""
    own, worth = known_by(asked.validator, asked.effect), worth_of(asked.validator, asked.gap, k)[1]
    first = int(np.argmax([-np.inf if asked.is_seen_past_edges(n) else one for n, one in enumerate(worth)]))
    sure = asked.gap.varies[k, own] > asked.limit.sure * asked.gap.chance[k, own]
    return bool(sure.any()) and all(asked.surely_left(k, n) <= asked.limit.left_by_exact for n in (first, *own))


def _made_together(asked: Asked) -> float:
    """How much any other cause makes holes go together."""
    without = ([one for one in asked.before if one is not cause] for cause in asked.named if "missing" in cause.kinds)
    return max((asked.validator.once(done_by, less, asked.before).lost_together for less in without), default=0.0)
