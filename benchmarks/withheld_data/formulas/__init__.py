"""The formulas, a family a file; :data:`FORMULAS` lists them by effect."""

from benchmarks.withheld_data.film import Formula
from benchmarks.withheld_data.formulas import (
    align,
    correlation,
    decimation,
    disparity,
    edges,
    filling,
    filters,
    history,
    holes,
    light,
    limits,
    noise,
    optics,
    outside,
    outside_errors,
    outside_holes,
    pattern,
    pose,
    poses,
    shadow,
    tails,
)

_FAMILIES = (
    pose,
    poses,
    optics,
    pattern,
    disparity,
    noise,
    correlation,
    tails,
    holes,
    light,
    shadow,
    limits,
    edges,
    decimation,
    filters,
    history,
    filling,
    align,
)


def _by_effect(*families: object) -> dict[str, tuple[type[Formula], ...]]:
    found: dict[str, tuple[type[Formula], ...]] = {}
    for family in families:
        for kind in vars(family).values():
            if isinstance(kind, type) and issubclass(kind, Formula) and vars(kind).get("effect"):
                found[kind.effect] = (*found.get(kind.effect, ()), kind)
    return found


FORMULAS = _by_effect(*_FAMILIES)
"""By the id of the effect, what may stand for it."""
OUTSIDE = _by_effect(outside, outside_errors, outside_holes)
"""The same for what no bank has."""
