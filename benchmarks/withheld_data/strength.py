"""How strong an effect is: by what it changes in these frames, not by its parameters.

    change      mean over the pixels of min(|dz| / std, 2): how far depths move, in base noise
    spread      root mean square over the pixels of ln(std / base std)
    holes       share of the pixels that become holes because of it
    spurious    share of the returns that move by more than three base std
    neighbours  mean correlation of the normalised errors of neighbours in x and y
    frames      mean correlation of the normalised error of a pixel with that of the frame before
    ratio_m     relative error of m (that material must fill 8 % of the pixels, at 0.8 m or more)
    doubled     share of the pixels that equal their left neighbour
    stuck       share of the frames that show an earlier one
    pooled      ln of how much smaller the spread of the errors becomes (median of their absolute values)
    filled      share of the pixels that are holes without it, and have depth with it

RANGES says what weak, medium and strong are. The amount of a formula is solved for, such that its statistic on a few
frames is a random value of the wanted range.
"""

from collections.abc import Sequence

import numpy as np

from benchmarks.withheld_data.film import Film, Formula, Take

STRENGTHS = ("weak", "medium", "strong")
Range = tuple[float, float]
RANGES: dict[str, tuple[Range, Range, Range]] = {
    "change": ((0.08, 0.15), (0.25, 0.5), (0.7, 1.1)),
    "spread": ((0.08, 0.14), (0.22, 0.4), (0.6, 1.0)),
    "holes": ((0.003, 0.007), (0.015, 0.035), (0.06, 0.12)),
    "spurious": ((0.001, 0.002), (0.004, 0.01), (0.015, 0.035)),
    "neighbours": ((0.08, 0.15), (0.3, 0.5), (0.7, 0.9)),
    "frames": ((0.1, 0.18), (0.35, 0.55), (0.7, 0.9)),
    "ratio_m": ((0.15, 0.2), (0.22, 0.3), (0.32, 0.45)),
    "doubled": ((0.1, 0.2), (0.25, 0.4), (0.45, 0.6)),
    "stuck": ((0.08, 0.15), (0.2, 0.35), (0.4, 0.6)),
    # Blocks of 2x2, 3x3 and 4x4 pixels.
    "pooled": ((0.4, 0.8), (0.81, 1.17), (1.18, 1.5)),
    "filled": ((0.015, 0.03), (0.04, 0.07), (0.09, 0.15)),
}
"""By statistic, the ranges of weak, medium and strong."""
SPECIAL: dict[str, tuple[Range, Range, Range]] = {
    "fill_rate": ((0.006, 0.01), (0.018, 0.03), (0.04, 0.055)),
    "invalid_band": ((0.009, 0.016), (0.018, 0.032), (0.036, 0.07)),
    "stereo_shadow": ((0.003, 0.007), (0.012, 0.03), (0.04, 0.1)),
    # Faces of one material and edges are a small part of an image.
    "specular_dropout": ((0.003, 0.007), (0.012, 0.03), (0.04, 0.1)),
    "moved_region": ((0.01, 0.02), (0.03, 0.06), (0.1, 0.2)),
    "foreign_thing": ((0.01, 0.02), (0.03, 0.06), (0.1, 0.2)),
    "noisy_place": ((0.05, 0.1), (0.15, 0.3), (0.4, 0.7)),
    # A filter in time with a weight of 0.4 correlates frames by 0.6, and by less where the camera moves.
    "temporal_filter": ((0.1, 0.16), (0.22, 0.34), (0.42, 0.58)),
    "spatial_filter": ((0.08, 0.15), (0.25, 0.45), (0.5, 0.85)),
}
"""By effect, where a real camera's range is another."""


def wanted_range(formula: type[Formula] | Formula, strength: str) -> Range:
    """The statistic's range of a strength."""
    ranges = SPECIAL.get(formula.effect, RANGES[formula.statistic])
    return ranges[STRENGTHS.index(strength)]


def probe_frames(film: Film) -> list[int]:
    """The frames that a statistic is taken on: four over the run, and the ones after two of them."""
    last = len(film) - 1
    return sorted({0, 1, last // 3, 2 * last // 3, 2 * last // 3 + (last > 2), last})


class Gauge:
    """Takes a formula's statistic on a film's probe frames, beside what ``others`` do; the frames without are kept."""

    def __init__(self, film: Film, statistic: str, others: Sequence[Formula] = ()) -> None:
        self._film, self._statistic, self._others = film, statistic, others
        self._noise = statistic != "spread"
        self._without: list[Take] = []

    def __call__(self, formula: Formula) -> float:
        """The statistic with ``formula`` added."""
        film, statistic = self._film, self._statistic
        if statistic == "ratio_m":
            return _ratio(film, formula)
        if statistic == "stuck":
            return float(np.mean([formula.shown(index) != index for index in range(len(film))]))
        formulas = (*self._others, formula)
        if statistic == "frames":
            return _between_frames(film, formulas)
        frames = probe_frames(film)
        if not self._without:
            self._without = [film.make(index, self._others, self._noise) for index in frames]
        with_it = (film.make(index, formulas, self._noise) for index in frames)
        return float(np.mean([_STATISTICS[statistic](*pair) for pair in zip(self._without, with_it, strict=True)]))


def solve(film: Film, formula: Formula, strength: str, share: float) -> float | None:
    """Set the amount; the statistic that it gives, or None where this scene does not show it so.

    share: 0 to 1, where in the range of the strength (by its logarithm). The statistic grows with the amount.
    """
    low, high = wanted_range(formula, strength)
    target, gauge = np.log(low * (high / low) ** share), Gauge(film, formula.statistic)

    def at(place: float) -> float:
        formula.amount = float(np.exp(place))
        return float(np.log(max(gauge(formula), 1e-9)))

    right = float(np.log(formula.span[1]))
    high_end = at(right)
    if high_end < target:
        # All that the formula can do may still be in the range.
        return _kept(formula, high_end, low, high)
    left = float(np.log(formula.span[0]))
    low_end = at(left)
    if low_end > target:
        return _kept(formula, low_end, low, high)
    value = low_end
    for _ in range(14):
        # By a straight line between the ends, but never so near to one of them that little is learned.
        line = (target - low_end) / max(high_end - low_end, 1e-9)
        value = at(left + float(np.clip(line, 0.2, 0.8)) * (right - left))
        if abs(value - target) < 0.04:
            break
        place = float(np.log(formula.amount))
        left, low_end, right, high_end = (
            (left, low_end, place, value) if value > target else (place, value, right, high_end)
        )
    return _kept(formula, value, low, high)


def _kept(formula: Formula, log_value: float, low: float, high: float) -> float | None:
    value = float(np.exp(log_value))
    return value if 0.97 * low <= value <= 1.03 * high and formula.plausible() else None


def _change(before: Take, after: Take) -> float:
    both = (before.z > 0) & (after.z > 0)
    moved = np.abs(after.z - before.z)[both] / np.maximum(before.sigma[both], 1e-6)
    return float(np.minimum(moved, 2).sum() / max(both.sum(), 1))


def _spread(before: Take, after: Take) -> float:
    both = (before.sigma > 0) & (after.sigma > 0)
    return float(np.sqrt(np.mean(np.log(after.sigma[both] / before.sigma[both]) ** 2))) if both.any() else 0.0


def _holes(before: Take, after: Take) -> float:
    return float(np.mean((before.z > 0) & (after.z <= 0)))


def _spurious(before: Take, after: Take) -> float:
    both = (before.z > 0) & (after.z > 0)
    return float(np.mean(np.abs(after.z - before.z)[both] > 3 * before.sigma[both])) if both.any() else 0.0


def _errors(take: Take) -> np.ndarray:
    """Errors over their std; not a number without a return."""
    with np.errstate(divide="ignore", invalid="ignore"):
        error = (take.z - take.geometry.depth) / take.sigma
    return np.where((take.z > 0) & (np.abs(error) < 5), error, np.nan)


def correlation(a: np.ndarray, b: np.ndarray) -> float:
    """Pearson's, of what is a number in both."""
    both = np.isfinite(a) & np.isfinite(b)
    return float(np.corrcoef(a[both], b[both])[0, 1]) if both.sum() > 10 else 0.0


def _neighbours(before: Take, after: Take) -> float:
    e = _errors(after)
    return (correlation(e[:, 1:], e[:, :-1]) + correlation(e[1:], e[:-1])) / 2


def _doubled(before: Take, after: Take) -> float:
    return float(np.mean((after.z[:, 1:] == after.z[:, :-1]) & (after.z[:, 1:] > 0)))


def _pooled(before: Take, after: Take) -> float:
    least = [np.nanmedian(np.abs(_errors(take))) for take in (before, after)]
    return float(max(np.log(least[0] / least[1]), 0.0))


def _filled(before: Take, after: Take) -> float:
    return float(np.mean((before.z <= 0) & (after.z > 0)))


def _between_frames(film: Film, formulas: Sequence[Formula]) -> float:
    many = [_errors(film.make(i, formulas)) for i in range(min(len(film), 8))]
    return float(np.mean([correlation(a, b) for a, b in zip(many[1:], many[:-1], strict=True)]))


def _ratio(film: Film, formula: Formula) -> float:
    tag = film.world.scene.tags.index(formula.parameters()["tag"])
    takes = [film.make(i, (), noise=False) for i in probe_frames(film)]
    share = np.mean([np.mean(take.geometry.tag == tag) for take in takes])
    depths = np.concatenate([take.z[take.geometry.tag == tag] for take in takes])
    seen = share >= 0.08 and np.median(depths) >= 0.8
    return formula.amount if seen else 0.0


_STATISTICS = {
    "change": _change,
    "spread": _spread,
    "holes": _holes,
    "spurious": _spurious,
    "neighbours": _neighbours,
    "doubled": _doubled,
    "pooled": _pooled,
    "filled": _filled,
}
