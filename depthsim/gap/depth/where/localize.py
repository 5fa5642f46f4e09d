"""Where the gap lies: along which axis, in which part of it, and in what way simulation and recording differ there.

The difference between the two distributions of the error has a mean over all pixels, which any axis shows, and a part
that changes from cell to cell. An axis is the one to look at as far as the difference changes along it: what causes the
gap changes with that axis itself, and with other axes only as they go together with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.config import DepthWhere
from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.data.axis import Axis
from depthsim.gap.depth.data.divergence import Counted, Ruler
from depthsim.gap.depth.data.evidence import Counts, Evidence
from depthsim.gap.depth.data.simulate import LOCATING
from depthsim.gap.depth.where.correction import learnable
from depthsim.gap.depth.where.differences import Difference, compare_cells, errors_together, holes_together
from depthsim.gap.depth.where.part import main_part
from depthsim.gap.diagnosis import Cut
from depthsim.sensor.effect import Effect

Floats = NDArray[np.float64]
PAIRS = (histograms.FAR_LEFT, histograms.FAR_UP, histograms.BEFORE)


@dataclass(frozen=True)
class Place:
    """An axis. depends: the part of the gap that changes along it; closes: what a correction along it would close, NaN
    where none was learned; shares: of the axis' gap, by cell; gap: bits per pixel in this axis. uniform: whether the
    gap is the same all over, and this axis stands for all.
    """

    axis: int
    depends: float
    closes: float
    shares: Floats
    gap: float
    uniform: bool = False


def locate(evidence: Evidence, ruler: Ruler, effects: Sequence[Effect]) -> list[Place]:
    """All axes, the one that matters most first. effects: the sensor that is compared with the recording."""
    limit = evidence.config.where
    real = evidence.real_counts(evidence.test).sum(axis=0)
    plain, another = (evidence.simulate(effects, evidence.test, seed=seed).sum(axis=0) for seed in LOCATING)
    excess = np.maximum(ruler.divergence(real, plain) - ruler.divergence(another, plain), 0) * ruler.totals(real)
    errors = [n for n, axis in enumerate(evidence.axes) if axis.kind == histograms.ERROR]
    pairs = [n for n, axis in enumerate(evidence.axes) if histograms.ERROR < axis.kind < histograms.ACROSS]
    changes = {n: _changes(evidence, n, real, plain, another) for n in errors}
    whole = max(max((total for _, total in changes.values()), default=0.0), 1e-12)
    depends = {n: float(np.clip(varies / whole, 0, 1)) for n, (varies, _) in changes.items()}
    uniform = max(depends.values(), default=0.0) < limit.uniform
    by_range = _as_the_spread(evidence, real, plain) if uniform else None
    if by_range is not None:
        depends[by_range] = 1.0
    first = sorted(errors, key=lambda n: axis_cost(evidence.axes[n], limit) - depends[n])
    closes = learnable(evidence, ruler, effects, [*first[: limit.corrections], *pairs])
    bits = np.maximum(ruler.by_axis(real, plain) - ruler.by_axis(another, plain), 0)
    alone = max((bits[n] for n in errors), default=0.0)
    pairs.sort(key=lambda n: -bits[n])
    own = {n: beyond_each(evidence, n, real, plain) - beyond_each(evidence, n, another, plain) for n in pairs}
    holes = {n: more_holes_together(evidence, n, real, plain) for n in pairs}
    own_bits, hole_bits = ({n: over_pixels(ruler, n, real, o) for n, o in each.items()} for each in (own, holes))
    ahead = [n for n in pairs if bits[n] > limit.paired * alone or own_bits[n] > limit.together * alone]
    in_holes = [n for n in pairs if n not in ahead and hole_bits[n] > limit.together * alone]
    others = [n for n in pairs if n not in (*ahead, *in_holes)]
    # Two errors differ by more bits than one, though they have nothing to do with each other: not so their difference.
    apart = [n for n in pairs if evidence.axes[n].kind not in PAIRS and uniform and bits[n] > alone]
    beside = in_holes + [n for n in others if own_bits[n] > limit.beside * alone or n in apart]
    order = [*ahead, *first[:1], *beside, *first[1:], *(n for n in pairs if n not in (*ahead, *beside))]
    found = []
    for number in order:
        own = excess[ruler.axis_of_cell == number]
        if own.any():
            pixels = max(ruler.totals(real)[ruler.axis_of_cell == number].sum(), 1)
            paired = 1.0 if number in (*ahead, *beside) else max(closes.get(number, 0.0), 0.0)
            value = depends.get(number, paired)
            gap, closed = float(own.sum() / pixels), closes.get(number, np.nan)
            found.append(Place(number, value, closed, own / own.sum(), gap, number == by_range))
    return found


def _as_the_spread(evidence: Evidence, real: Counts, plain: Counts) -> int | None:
    """The axis by range, where the whole gap is one bias, one factor of the spread, or one other shape of the errors.

    Errors are measured in units of the simulator's spread. What is the same everywhere in those changes in metres as
    the spread does, which is a function of the range.
    """
    axes = enumerate(evidence.axes)
    number = next((n for n, v in axes if v.name == "range" and v.single and v.kind == histograms.ERROR), None)
    if number is None:
        return None
    what = compare_cells(evidence, number, np.arange(evidence.axes[number].size), real, plain, shapes=True).what
    return number if what != "missing" else None


def _changes(evidence: Evidence, number: int, real: Counts, plain: Counts, another: Counts) -> tuple[float, float]:
    """The part of the squared Hellinger distance that changes along an axis, and the whole of it, over chance."""
    axis = evidence.axes[number]
    bins = int(histograms.BINS[axis.kind])
    everything = int(evidence.axes[0].size) * bins

    def roots(counts: Counts) -> tuple[Floats, Floats]:
        cells = evidence.cells(number, counts).astype(float)
        # Some axes leave pixels out: those are one cell more.
        outside = counts[:everything].reshape(-1, bins).sum(axis=0) - cells.sum(axis=0)
        cells = np.vstack([cells, np.maximum(outside, 0)])
        pixels = cells.sum(axis=1)
        return np.sqrt(cells / np.maximum(pixels, 1)[:, None]), pixels

    (a, pixels), (b, _), (c, _) = roots(real), roots(plain), roots(another)
    weights = pixels / max(pixels.sum(), 1)

    def parts(x: Floats, y: Floats) -> tuple[float, float]:
        difference = x - y
        mean = weights @ difference
        return float(weights @ ((difference - mean) ** 2).sum(axis=1)), float(weights @ (difference**2).sum(axis=1))

    (varies, whole), (chance_varies, chance) = parts(a, b), parts(c, b)
    return max(varies - chance_varies, 0.0), max(whole - chance, 0.0)


def over_pixels(ruler: Ruler, number: int, counts: Counted, of_cells: Floats) -> float:
    """The mean over the pixels of an axis of what each of its cells has. counts: of the pixels; of_cells: (cells,)."""
    totals = ruler.totals(counts)[ruler.axis_of_cell == number]
    return float((of_cells * totals).sum() / max(totals.sum(), 1))


def beyond_each(evidence: Evidence, number: int, x: NDArray[Any], y: NDArray[Any]) -> Floats:
    """(cells,) how pairs of errors differ beyond what either error alone does [bits]; 0 for an axis without pairs."""
    if evidence.axes[number].kind not in PAIRS:
        return np.zeros(evidence.axes[number].size)
    return errors_together(*(evidence.cells(number, counts) for counts in (x, y)))


def more_holes_together(evidence: Evidence, number: int, x: NDArray[Any], y: NDArray[Any]) -> Floats:
    """(cells,) by how much more holes go together in x than in y [bits]; 0 for an axis without pairs."""
    if evidence.axes[number].kind not in PAIRS:
        return np.zeros(evidence.axes[number].size)
    return holes_together(evidence.cells(number, x)) - holes_together(evidence.cells(number, y))


def axis_cost(axis: Axis, limit: DepthWhere) -> float:
    """What an axis must explain more, as a share of the gap, for having many cells or being a pair."""
    return limit.per_doubling * max(np.log2(axis.size / 8), 0.0) + (0.0 if axis.single else limit.pair)


def cuts_of(evidence: Evidence, effects: Sequence[Effect], places: Sequence[Place]) -> tuple[Cut, ...]:
    """The ranked list for diagnosis.json: each axis once, with the part of it that holds most of its gap."""
    real = evidence.real_counts(evidence.test).sum(axis=0)
    simulated = evidence.simulate(effects, evidence.test, seed=LOCATING[0]).sum(axis=0)
    limit = evidence.config.where
    cuts: list[Cut] = []
    seen: set[str] = set()
    for place in places:
        axis = evidence.axes[place.axis]
        if axis.name in seen or place.depends < limit.least_share or len(cuts) >= limit.most_axes:
            continue
        seen.add(axis.name)
        cells = main_part(axis, place.shares)
        difference = compare_cells(evidence, place.axis, cells, real, simulated, shapes=place.uniform)
        cuts.append(_tell(evidence, place, cells, difference))
        if difference.what == "tail" and "residual_tail" not in seen:
            seen.add("residual_tail")
            share = difference.sizes["tail"] / max(sum(difference.sizes.values()), 1e-12)
            label, words = difference.tail, difference.words
            own = Cut(axis="residual_tail", label=label, share_of_gap=share, what="tail", text=words)
            cuts.insert(len(cuts) - place.uniform, own)
    return tuple(cuts)


def _tell(evidence: Evidence, place: Place, cells: NDArray[np.int64], difference: Difference) -> Cut:
    axis = evidence.axes[place.axis]
    share = float(place.shares[cells].sum())
    interval = axis.interval(cells)
    return Cut(
        axis=axis.name,
        interval=interval,
        label=None if interval else axis.label(cells),
        unit=axis.unit if interval else "",
        share_of_gap=share,
        what=difference.what,
        text=difference.words,
    )
