"""What a result counts as, in each tier."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import binomtest

Result = dict[str, Any]

EXPERT = {
    "disparity_noise", "spatial_correlation", "temporal_correlation", "stereo_shadow", "invalid_band",
    "edge_fattening", "flying_pixels", "disparity_quantization", "subpixel_bias", "incidence_noise",
    "incidence_dropout", "range_dropout", "material_dropout", "specular_dropout", "ambient_light", "fill_rate",
    "material_noise", "heavy_tails", "min_range", "spatial_filter", "lateral_noise",
    "matching_window",
}  # fmt: skip
"""What a matcher of two images does by its nature. The poses, clocks and calibration of the stereo camera are exact."""
EXPERT_D435 = EXPERT | {
    "lens_distortion",
    "disparity_offset",
    "baseline_scale",
    "vignetting_noise",
    "extrinsic_rotation",
    "extrinsic_translation",
}
"""Of a real unit also its calibration, and the poses, which were fitted to the floor."""


@dataclass(frozen=True)
class Count:
    """So many of so many; ``target`` is the share that is asked for, with ``most`` where less is better."""

    what: str
    good: int
    of: int
    target: float | None = None
    most: bool = False

    @property
    def share(self) -> float:
        """Not a number for none."""
        return self.good / self.of if self.of else math.nan

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval (Wilson 1927)."""
        return wilson(self.good, self.of)


def wilson(good: int, of: int) -> tuple[float, float]:
    """The 95 % score interval of a share; 0 to 1 for none."""
    return tuple(binomtest(good, of).proportion_ci(method="wilson")) if of else (0.0, 1.0)


def named(result: Result) -> list[str]:
    """The causes in their order. An m that is off counts neither as wrong nor as required."""
    causes = [cause["effect"] for cause in result["diagnosis"]["causes"]]
    if result["truth"]["m_offsets"] and "material_noise" not in wanted(result):
        causes = [effect for effect in causes if effect != "material_noise"]
    return causes


def wanted(result: Result) -> list[str]:
    """The effects that were withheld."""
    return [effect["effect"] for effect in result["truth"]["effects"]]


def first(result: Result) -> str:
    """The first cause; ``no gap`` or ``unknown`` without one."""
    causes = named(result)
    if causes:
        return causes[0]
    return "no gap" if result["diagnosis"]["verdict"] == "no_gap" else "unknown"


def is_tie(result: Result) -> bool:
    """Whether the first cause is another, but told as one that these data cannot tell from the right one."""
    right = wanted(result)[0]
    causes = [c for c in result["diagnosis"]["causes"] if c["effect"] == first(result)]
    return bool(causes) and right in causes[0].get("indistinguishable_from", ())


def strength(result: Result) -> str:
    """Of the first effect."""
    return str(result["truth"]["effects"][0]["strength"])


def tier_a(results: Iterable[Result]) -> list[Count]:
    """First cause, further causes."""
    done = list(results)
    clear = [r for r in done if strength(r) != "weak"]
    weak = [r for r in done if strength(r) == "weak"]
    felt = [r for r in weak if first(r) != "no gap"]
    counts = [
        *_right("medium and strong", clear, 0.97),
        Count("a gap is told, weak", len(felt), len(weak)),
        *_right("weak, where a gap is told", felt, 0.9),
    ]
    some = [r for r in done if named(r)]
    counts.append(
        Count("no further cause", sum(set(named(r)) <= set(wanted(r)) | {first(r)} for r in some), len(some), 0.95)
    )
    return counts


def _right(what: str, group: list[Result], target: float) -> list[Count]:
    right = sum(first(r) == wanted(r)[0] for r in group)
    ties = sum(first(r) != wanted(r)[0] and is_tie(r) for r in group)
    return [
        Count(f"first cause is right, {what}", right, len(group), target),
        Count("  or told as one of a tie", right + ties, len(group)),
    ]


def tier_b(results: Iterable[Result]) -> list[Count]:
    """Nothing named that is not there, and where the gap lies. A wrong name beside a right axis is a wrong name."""
    done = list(results)
    unnamed = [r for r in done if set(named(r)) <= set(r["truth"].get("right_names", ()))]
    right = [r for r in done if set(axes(r)) & set(r["truth"]["right_axes"])]
    primary = [r for r in done if r["truth"]["right_axes"][0] in axes(r)]
    return [
        Count("no wrong name", len(unnamed), len(done), 0.85),
        Count("a right axis among the first two", len(right), len(done), 0.9),
        Count("  the axis that fits best among the first two", len(primary), len(done)),
    ]


def apart(results: Iterable[Result]) -> list[Count]:
    """Where the report says explained, and an independent test does not agree."""
    done = [r["apart"] for r in results if "bits" in r.get("apart", {})]
    wrong = sum(one["bits"] > 2 * one["null"] for one in done)
    return [Count("explained, and yet the independent test is above twice its null", wrong, len(done), 0.03, most=True)]


def axes(result: Result) -> list[str]:
    """The axes of the first two cuts of what is not explained; a pair counts as both of its axes."""
    left = result["diagnosis"]["unexplained"]
    cuts = (left and left["where"]) or result["diagnosis"]["where"]
    return [axis for cut in cuts[:2] for axis in cut["axis"].split(" x ")]


def tier_c(results: Iterable[Result]) -> list[Count]:
    """All causes, none wrong; and of those cases whose effects are each found, beside the others or else alone."""
    done = list(results)
    asked = [r for r in done if "alone" in r]
    alone = [r for r in asked if all(effect in names for effect, names in r["alone"].items())]
    return [
        Count("all causes named", sum(set(wanted(r)) <= set(named(r)) for r in done), len(done)),
        Count("  where each is found alone", sum(set(wanted(r)) <= set(named(r)) for r in alone), len(alone), 0.8),
        Count("none wrong", sum(set(named(r)) <= set(wanted(r)) for r in done), len(done), 0.95),
        Count("  where each is found alone", sum(set(named(r)) <= set(wanted(r)) for r in alone), len(alone), 0.95),
    ]


def tier_d(results: Iterable[Result]) -> list[Count]:
    """A gap where there is none; an m that is off is one that may be told."""
    done = list(results)
    return [Count("a gap claimed", sum(_claims(r) for r in done), len(done), 0.02, most=True)]


def _claims(result: Result) -> bool:
    causes = result["diagnosis"]["causes"]
    if result["truth"]["m_offsets"] and {c["effect"] for c in causes} == {"material_noise"}:
        return False
    return result["diagnosis"]["verdict"] != "no_gap"


def expert(results: Iterable[Result]) -> list[Count]:
    """Tiers e and f: nothing that a stereo expert would not sign."""
    done = list(results)
    allowed = {id(r): EXPERT_D435 if r["truth"]["tier"] == "f" else EXPERT for r in done}
    signed = sum({c["effect"] for c in r["diagnosis"]["causes"]} <= allowed[id(r)] for r in done)
    closed = sum(r["diagnosis"]["gap"]["closed_fraction"] >= 0.7 for r in done)
    return [
        Count("causes that an expert would sign", signed, len(done)),
        Count("closes 0.7 of the gap or more", closed, len(done)),
    ]


def coverage(results: Iterable[Result]) -> list[Count]:
    """How often the truth lies in the 95 % intervals."""
    done = list(results)
    gap = [(r["remeasured"]["closed_fraction"], r["diagnosis"]["gap"]["ci95"]) for r in done if _measured(r)]
    inside = [low <= value <= high for value, (low, high) in gap]
    known = [pair for r in done for pair in _known(r)]
    covered = [low <= value <= high for value, (low, high) in known]
    return [
        Count("closed fraction in its interval (0.90 to 0.98)", sum(inside), len(inside), 0.9),
        Count("known parameters in their intervals (0.90 to 0.98)", sum(covered), len(covered), 0.9),
    ]


def closed(results: Iterable[Result]) -> list[float]:
    """The fractions of the gap that were closed, measured again on fresh frames, where a cause is told."""
    return [r["remeasured"]["closed_fraction"] for r in results if _measured(r)]


def _measured(result: Result) -> bool:
    again = result.get("remeasured")
    return again is not None and "error" not in again and bool(result["diagnosis"]["causes"])


def _known(result: Result) -> list[tuple[float, tuple[float, float]]]:
    """Pairs of truth and interval, of the right cause's parameters that mean the same in both formulas."""
    pairs = []
    for effect in result["truth"]["effects"]:
        for cause in result["diagnosis"]["causes"]:
            if cause["effect"] == effect["effect"]:
                pairs += _pairs(effect["known_parameters"], cause["ci95"])
    return pairs


def _pairs(known: dict[str, Any], intervals: dict[str, Any]) -> list[tuple[float, tuple[float, float]]]:
    pairs = []
    for key, value in known.items():
        if isinstance(value, dict):
            inner = intervals.get(key) or {
                name.partition(".")[2]: interval for name, interval in intervals.items() if name.startswith(f"{key}.")
            }
            pairs += _pairs(value, inner)
        elif intervals.get(key) is not None:
            low, high = intervals[key]
            pairs.append((float(value), (float(low), float(high))))
    return pairs


def rival(results: Iterable[Result], which: str) -> list[Count]:
    """What a rival's name for the first cause is worth, on the same cases."""
    done = [r for r in results if "error" not in r.get("rivals", {"error": ""})]
    counts = []
    for what, strengths in (("medium and strong", ("medium", "strong")), ("weak", ("weak",))):
        group = [r for r in done if strength(r) in strengths]
        counts.append(
            Count(f"first cause is right, {what}", sum(r["rivals"][which] == wanted(r)[0] for r in group), len(group))
        )
    return counts


def confusion(results: Iterable[Result]) -> tuple[list[str], list[str], np.ndarray]:
    """Rows: the effect withheld; columns: the first cause told."""
    done = list(results)
    rows = sorted({wanted(r)[0] for r in done})
    columns = [*sorted({*rows, *(first(r) for r in done)} - {"no gap", "unknown"}), "unknown", "no gap"]
    table = np.zeros((len(rows), len(columns)), int)
    for r in done:
        table[rows.index(wanted(r)[0]), columns.index(first(r))] += 1
    return rows, columns, table
