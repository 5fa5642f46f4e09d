"""In what way two sets of errors differ: bias, spread, holes, tails, or how neighbours go together."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.distance import jensenshannon

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.histograms import ACROSS, ERROR, ERROR_HOLE, ERROR_NO_SURFACE, MAGNITUDES, UP
from depthsim.gap.diagnosis import What
from depthsim.kernels import kernel

_MIDDLES = np.concatenate([[0], (MAGNITUDES[:-1] + MAGNITUDES[1:]) / 2, [100]])
_CENTRES = np.concatenate([-_MIDDLES[::-1], _MIDDLES])
_CENTRES[15], _CENTRES[16] = -0.07, 0.07
_EDGES = np.concatenate([-MAGNITUDES[::-1], [0], MAGNITUDES, [140]]).astype(np.float64)
TAIL = 4.5
"""Errors beyond so many spreads of the simulator are reported as tails, where both have few of them."""
_QUANTILES = np.array([0.005, 0.02, 0.06, 0.16, 0.3, 0.5, 0.7, 0.84, 0.94, 0.98, 0.995])
_LEANS = 1.2
"""Times as wide on one side of the median as on the other: worth saying."""


@dataclass(frozen=True)
class Difference:
    """what: the kind that makes most of it; sizes: bits by kind; words: in numbers.

    bias [spreads of the simulator], spread: real over simulated, holes: their shares (real, simulated); tail: which
    errors a tail is of.
    """

    what: What
    sizes: dict[str, float]
    words: str
    bias: float
    spread: float
    holes: tuple[float, float]
    tail: str = ""


def compare_cells(
    evidence: Evidence,
    axis: int,
    cells: NDArray[np.int64],
    real: NDArray[np.integer],
    simulated: NDArray[np.integer],
    *,
    shapes: bool = False,
) -> Difference:
    """What differs in some cells of an axis. shapes: whether another shape of the errors is told as a tail, too."""
    kind = evidence.axes[axis].kind
    a, b = (evidence.cells(axis, counts)[cells].astype(float) for counts in (real, simulated))
    if kind != ERROR:
        whose = evidence.axes[axis].label(cells)
        of_holes = UP < kind < ACROSS and (holes_together(a) - holes_together(b)).sum() > errors_together(a, b).sum()
        what: What = "missing" if of_holes else "correlation"
        words = f"{'holes' if of_holes else 'errors'} of {whose} go together in another way"
        return Difference(what, {what: 1.0}, words, 0.0, 1.0, (0.0, 0.0))
    weight = a.sum(axis=1) / max(a.sum(), 1)
    parts = [_one(x, y) for x, y in zip(a, b, strict=True)]
    sizes = {key: float(sum(w * p[0][key] for w, p in zip(weight, parts, strict=True))) for key in parts[0][0]}
    numbers = np.array([p[1] for p in parts])
    bias = float(weight @ numbers[:, 0])
    spread = float(np.exp(weight @ np.log(np.maximum(numbers[:, 1], 1e-3))))
    holes = float(weight @ numbers[:, 2]), float(weight @ numbers[:, 3])
    tails = float(weight @ numbers[:, 4]), float(weight @ numbers[:, 5])
    up_to = "up to " if len(cells) > 1 else ""
    said = {
        "bias": f"median error {up_to}{_biggest(numbers[:, 0]):+.2f} times the simulator's spread",
        "spread": f"std {spread:.2f} times the simulator's",
        "missing": f"holes {100 * holes[0]:.1f} % against {100 * holes[1]:.1f} % simulated",
        "tail": f"{100 * tails[0]:.2f} % beyond {TAIL} spreads against {100 * tails[1]:.2f} % simulated",
    }
    tail = f"errors beyond {TAIL} times the simulator's spread"
    if shapes and (shape := _shape(a.sum(axis=0), b.sum(axis=0))).size > sizes["tail"]:
        sizes["tail"], said["tail"], tail = shape.size, shape.words, "errors of all sizes"
    most = max(sizes, key=lambda key: sizes[key])
    return Difference(most, sizes, said[most], bias, spread, holes, tail)  # type: ignore[arg-type]


def errors_together(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
    """(cells,) the divergence of two sets of histograms of pairs (cells, bins) beyond what either error has [bits].

    Two recordings that differ by a bias differ in their pairs as well, though no error has to do with another.
    """
    pairs = [counts[:, :25].reshape(-1, 5, 5) for counts in (a, b)]
    joint, one, other = (_apart(*(p.sum(axis=sums).reshape(len(p), -1) for p in pairs)) for sums in ((), (1,), (2,)))
    return np.maximum(joint - one - other, 0)


def together_more(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
    """As :func:`errors_together`, where errors go together more in ``a`` than in ``b``; 0 elsewhere.

    Outliers one by one among noise that goes together make it go together less.
    """
    more, less = (_dependence(counts[:, :25].reshape(-1, 5, 5)) for counts in (a, b))
    return np.where(more > less, errors_together(a, b), 0)


def holes_together(counts: NDArray[np.floating]) -> NDArray[np.float64]:
    """(cells,) how far from independent the holes of pairs are (cells, bins) [bits]: lost lines, blocks, specks."""
    return _dependence(np.column_stack([counts[:, :25].sum(axis=1), counts[:, 25:28]]).reshape(-1, 2, 2))


def _dependence(pairs: NDArray[np.floating]) -> NDArray[np.float64]:
    """(cells,) how far from independent the two of pairs are (cells, one, other) [bits]."""
    both = pairs / np.maximum(pairs.sum(axis=(1, 2), keepdims=True), 1)
    apart = both.sum(axis=2, keepdims=True) * both.sum(axis=1, keepdims=True)
    return _apart(*(x.reshape(len(both), -1) for x in (both, apart)))


def _apart(a: NDArray[np.floating], b: NDArray[np.floating]) -> NDArray[np.float64]:
    """(cells,) Jensen–Shannon divergence of distributions (cells, bins) [bits]."""
    with np.errstate(invalid="ignore"):  # of what is alike, rounding may leave less than nothing under the root
        return np.asarray(np.nan_to_num(jensenshannon(a + 1e-9, b + 1e-9, base=2, axis=1)) ** 2)


def _biggest(values: NDArray[np.floating]) -> float:
    return float(values[np.argmax(np.abs(values))])


def _one(a: NDArray[np.floating], b: NDArray[np.floating]) -> tuple[dict[str, float], tuple[float, ...]]:
    holes_a, holes_b = (float(x[ERROR_HOLE:ERROR_NO_SURFACE].sum() / max(x.sum(), 1)) for x in (a, b))
    seen_a, seen_b = (x[:ERROR_HOLE] / max(x[:ERROR_HOLE].sum(), 1) for x in (a, b))
    core = np.abs(_CENTRES) < TAIL
    far_a, far_b = (float(x[~core].sum()) for x in (seen_a, seen_b))
    (mean_a, std_a), (mean_b, std_b) = ((m.item(), s.item()) for m, s in (_core(x[None]) for x in (seen_a, seen_b)))
    valid = 1 - (holes_a + holes_b) / 2
    shift = mean_a - mean_b
    sizes = {
        "bias": valid * min(shift**2 / (4 * (std_a**2 + std_b**2) * np.log(2)), 1.0),
        "spread": valid * min(np.log(std_a / std_b) ** 2 / (4 * np.log(2)), 1.0),
        "missing": _binary(holes_a, holes_b),
        "tail": valid * _binary(far_a, far_b) if max(far_a, far_b) < 0.2 else 0.0,
    }
    return sizes, (shift, std_a / std_b, holes_a, holes_b, far_a, far_b)


class _Shape(NamedTuple):
    """size: bits; words: on which side there is more."""

    size: float
    words: str


def _shape(a: NDArray[np.floating], b: NDArray[np.floating]) -> _Shape:
    """How two histograms of errors (bins,) differ but for their medians and spreads, which are made alike.

    By the shares between quantiles of the second: steps, which fill one bin and leave the next empty, are no shape. It
    counts half, as a bias or a factor of the spread is to be told first.
    """
    sums, edges = [], np.concatenate([[-140.0], _EDGES])
    for x in (a, b):
        sums.append(np.concatenate([[0], np.cumsum(x[:ERROR_HOLE] / max(x[:ERROR_HOLE].sum(), 1))]))
    (mean_a, std_a), (mean_b, std_b) = ((m.item(), s.item()) for m, s in (_core(np.diff(x)[None]) for x in sums))
    places = np.interp(_QUANTILES, sums[1], edges)
    moved = (places - mean_b) / std_b * std_a + mean_a
    below = [np.interp(moved, edges, sums[0]), np.interp(places, edges, sums[1])]
    shares = [np.diff(np.concatenate([[0], x, [1]])) for x in below]
    low, high = (float(x) for x in np.interp([0.16, 0.84], sums[0], edges) - mean_a)
    side = "farther" if high > -low else "nearer"
    ratio = max(high, -low, 1e-6) / max(min(high, -low), 1e-6)
    leans = f", {ratio:.1f} times as wide on the {side} side as on the other" if ratio > _LEANS else ""
    return _Shape(float(_apart(*(x[None] for x in shares))[0]) / 2, f"errors are distributed in another shape{leans}")


@dataclass(frozen=True)
class Moments:
    """Of histograms of errors, (cells,) each: median and spread [spreads of the simulator], and the share of holes."""

    middle: NDArray[np.float64]
    spread: NDArray[np.float64]
    holes: NDArray[np.float64]


def moments(counts: NDArray[np.floating]) -> Moments:
    """Of histograms of errors (cells, bins). The spread is half the distance of the 16 % and 84 % quantiles."""
    holes = counts[:, ERROR_HOLE:ERROR_NO_SURFACE].sum(axis=1) / np.maximum(counts.sum(axis=1), 1)
    seen = counts[:, :ERROR_HOLE] / np.maximum(counts[:, :ERROR_HOLE].sum(axis=1, keepdims=True), 1)
    middle, spread = _core(seen)
    return Moments(middle, spread, holes)


def tails(
    a: NDArray[np.floating], b: NDArray[np.floating], one: Moments, other: Moments
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(cells,) of two sets of histograms of errors (cells, bins), the shares that are far from each one's median.

    one, other: the moments of each.
    """
    far = TAIL * np.maximum(one.spread, other.spread)
    found = []
    for counts, own in ((a, one), (b, other)):
        seen = counts[:, :ERROR_HOLE]
        beyond = np.abs(_CENTRES - own.middle[:, None]) > far[:, None]
        found.append((seen * beyond).sum(axis=1) / np.maximum(seen.sum(axis=1), 1))
    return found[0], found[1]


def _core(shares: NDArray[np.floating]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(cells,) median and spread from shares by bin (cells, bins), interpolated; 0 and 1 of none."""
    middle, spread = np.zeros(len(shares)), np.ones(len(shares))
    _quantiles(shares, _EDGES, middle, spread)
    return middle, spread


@kernel
def _quantiles(shares, edges, middle, spread):
    found, sums = np.empty(3), np.empty(shares.shape[1])
    for cell in range(len(shares)):
        whole = 0.0
        for k in range(sums.size):
            whole += shares[cell, k]
            sums[k] = whole
        if whole <= 0:
            continue
        for q, share in enumerate((0.16, 0.5, 0.84)):
            after = 0
            while sums[after] / whole < share and after < sums.size - 1:
                after += 1
            before = max(after - 1, 0)
            low, high = sums[before] / whole, sums[after] / whole
            part = min((share - low) / (high - low), 1.0) if high > low else 0.0
            found[q] = edges[before] + part * (edges[after] - edges[before])
        middle[cell], spread[cell] = found[1], max((found[2] - found[0]) / 2, 0.05)


def _binary(p: float, q: float) -> float:
    """Jensen–Shannon divergence of two shares [bits]."""

    def entropy(x: float) -> float:
        x = min(max(x, 1e-12), 1 - 1e-12)
        return float(-x * np.log2(x) - (1 - x) * np.log2(1 - x))

    return max(entropy((p + q) / 2) - (entropy(p) + entropy(q)) / 2, 0.0)
