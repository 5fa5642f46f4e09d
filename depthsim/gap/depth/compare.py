"""Two recordings of one scene without a simulator: whether their cameras differ, and how.

Each is compared with its own clean geometry; errors are measured in one unit for both, the spread that the paper's
sensor would have. Pixels are given weights by which both runs have seen the same ranges of the same materials, so that
what the cameras looked at does not count. The floor is the gap between two halves that have as much of each run.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.gap.config import DepthCompare, DepthConfig
from depthsim.gap.depth.data.divergence import MEASURE, UNIT, Ruler
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.histograms import ACROSS, BINS, ERROR, PHASE
from depthsim.gap.depth.where.differences import Difference, compare_cells
from depthsim.gap.depth.where.localize import PAIRS, beyond_each
from depthsim.gap.depth.where.part import main_part
from depthsim.gap.diagnosis import Cut, Diagnosis, Gap, Unexplained
from depthsim.gap.report.words import place as place_in_words
from depthsim.materials import Materials, load_materials
from depthsim.runs.folder import Run, open_run
from depthsim.scene import Scene
from depthsim.scenefile.load import load_scene
from depthsim.sensor.profile import load_profile

Floats = NDArray[np.float64]
Say = Callable[[str], None]


@dataclass(frozen=True)
class Comparison:
    """Two recordings, compared. counts_a, counts_b: (blocks, size), weighted; overlap: share of what both have seen."""

    diagnosis: Diagnosis
    a: Evidence
    b: Evidence
    counts_a: Floats
    counts_b: Floats
    overlap: float


def compare(
    first: str | Path | Run,
    second: str | Path | Run,
    *,
    scene: str | Path | Scene | None = None,
    out: str | Path | None = None,
    threads: int | None = None,
    materials: str | Path | Materials | None = None,
    config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
    say: Say = lambda _: None,
) -> Diagnosis:
    """Where two recordings of one scene differ, and in what way; see :func:`compare_runs`.

    out: a folder for diagnosis.json and index.html.
    """
    compared = compare_runs(first, second, scene=scene, threads=threads, materials=materials, config=config, say=say)
    if out is None:
        return compared.diagnosis
    from depthsim.gap.depth.report.compare import write_comparison

    say("drawing the report")
    write_comparison(compared, Path(out))
    return compared.diagnosis.in_report(out)


def compare_runs(
    first: str | Path | Run,
    second: str | Path | Run,
    *,
    scene: str | Path | Scene | None = None,
    threads: int | None = None,
    materials: str | Path | Materials | None = None,
    config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
    say: Say = lambda _: None,
) -> Comparison:
    """Where two recordings of one scene differ, and in what way. scene: that of the first, or of the second.

    Raises :class:`InputError` for a run or a scene that cannot be read.
    """
    runs, materials = (open_run(first), open_run(second)), load_materials(materials)
    place = _scene(runs, scene, materials)
    scale = load_profile("paper").effects
    say("casting the scene for A")
    a = Evidence(runs[0], place, materials, scale, threads, config=config)
    say("casting the scene for B")
    b = Evidence(runs[1], place, materials, scale, threads, a, config)
    if a.size != b.size:
        raise InputError(runs[1].path, "", "has stamps that do not advance", "give runs of 2 or more different stamps")
    say("comparing")
    ruler, limit = Ruler.of(a.axes), config.compare
    counts_a, counts_b, overlap = _weighted(a, b, limit)
    gap = _apart(ruler, counts_a, counts_b)
    splits = _splits(counts_a, counts_b, limit.splits)
    chance = np.array([_apart(ruler, *pair) for pair in splits])
    floor = float(chance.mean())
    differ = gap > max(floor + limit.above * float(chance.std()), float(chance.max()), limit.ratio * floor)
    found = Gap(measure=MEASURE, unit=UNIT, before=gap, after=gap, floor=floor, closed_fraction=0.0, ci95=(0.0, 0.0))
    where = _where(a, ruler, counts_a, counts_b, splits) if differ else ()
    unexplained = Unexplained(fraction=1.0, where=where, description=_describe(where)) if differ else None
    diagnosis = Diagnosis(
        verdict="unexplained" if differ else "no_gap",
        gap=found,
        where=where,
        causes=(),
        unexplained=unexplained,
        notes=_notes(a, b, overlap),
    )
    return Comparison(diagnosis, a, b, counts_a, counts_b, overlap)


def _scene(runs: tuple[Run, Run], scene: str | Path | Scene | None, materials: Materials) -> Scene:
    found = scene if scene is not None else runs[0].scene or runs[1].scene
    if found is None:
        raise InputError(runs[0].path, "", "holds no scene, nor does the other run", "put one there, or give `scene`")
    return load_scene(found, materials=materials).started(float(runs[0].stamps[0]))


def _weighted(a: Evidence, b: Evidence, limit: DepthCompare) -> tuple[Floats, Floats, float]:
    """The counts of both as if they had seen the same ranges of the same materials, and how much both have seen."""
    number = next(n for n, axis in enumerate(a.axes) if axis.name == "range x material" and axis.kind == ERROR)
    shares = []
    for one in (a, b):
        counts = one.real_counts(range(len(one.blocks))).sum(axis=0)
        pixels = one.cells(number, counts).sum(axis=1).astype(np.float64)
        shares.append(pixels / max(pixels.sum(), 1))
    both = np.minimum(*shares)
    weighted = []
    for one, share in zip((a, b), shares, strict=True):
        weight = np.clip(both / np.maximum(share, 1e-12), 0, limit.largest_weight)
        ratio = np.repeat(weight, int(BINS[ERROR]))
        correction = number, int(a.offsets[number]), ratio, np.zeros_like(ratio), np.zeros(len(weight), np.int64)
        weighted.append(_recounted(one, correction))
    return weighted[0], weighted[1], float(both.sum())


def _recounted(one: Evidence, correction: tuple[object, ...]) -> Floats:
    def count(block: int) -> Floats:
        return one.recount(block, (one.recorded(int(i)) for i in one.blocks[block]), correction)

    return np.stack(one.each(count, range(len(one.blocks))))


def _apart(ruler: Ruler, a: Floats, b: Floats) -> float:
    """The gap of two sets of blocks, the same either way."""
    x, y = a.sum(axis=0), b.sum(axis=0)
    return (ruler.gap(x, y) + ruler.gap(y, x)) / 2


def _splits(a: Floats, b: Floats, count: int) -> list[tuple[Floats, Floats]]:
    """Halves that have as many blocks of each run."""
    draws = np.random.Generator(np.random.Philox(key=[0, 0x5A1]))
    found = []
    for _ in range(count):
        parts: tuple[list[Floats], list[Floats]] = ([], [])
        for turn, counts in enumerate((a, b)):
            order = draws.permutation(len(counts))
            half = (len(order) + turn) // 2
            parts[0].append(counts[order[:half]])
            parts[1].append(counts[order[half:]])
        found.append((np.concatenate(parts[0]), np.concatenate(parts[1])))
    return found


def _where(
    a: Evidence, ruler: Ruler, counts_a: Floats, counts_b: Floats, splits: list[tuple[Floats, Floats]]
) -> tuple[Cut, ...]:
    """Each axis once, the one along which the two differ most first, with the part that holds most of it."""
    x, y = counts_a.sum(axis=0), counts_b.sum(axis=0)
    chance = np.mean([ruler.divergence(p.sum(axis=0), q.sum(axis=0)) for p, q in splits[:8]], axis=0)
    excess = np.maximum(ruler.divergence(x, y) - chance, 0)
    totals = (ruler.totals(x) + ruler.totals(y)) / 2
    found: list[tuple[float, Cut]] = []
    for number, axis in enumerate(a.axes):
        if axis.kind >= PHASE or axis.kind == ACROSS or not (axis.single or axis.kind != ERROR):
            continue
        inside = ruler.axis_of_cell == number
        bits = excess[inside] * totals[inside]
        if axis.kind in PAIRS:
            bits = np.minimum(bits, beyond_each(a, number, x, y) * totals[inside])
        if not bits.any():
            continue
        cells = main_part(axis, bits / bits.sum())
        difference = compare_cells(a, number, cells, y, x)
        interval = axis.interval(cells)
        cut = Cut(
            axis=axis.name,
            interval=interval,
            label=None if interval else axis.label(cells),
            unit=axis.unit if interval else "",
            share_of_gap=float(bits[cells].sum() / bits.sum()),
            what=difference.what,
            text=_in_words(difference),
        )
        found.append((float(bits.sum() / max(totals[inside].sum(), 1)), cut))
    cuts: dict[str, Cut] = {}
    for _, cut in sorted(found, key=lambda pair: -pair[0]):
        cuts.setdefault(cut.axis, cut)
    return tuple(cuts.values())[: a.config.where.most_axes]


def _in_words(difference: Difference) -> str:
    """A difference in words; bias, spread and holes of B against A."""
    match difference.what:
        case "spread":
            noisier, ratio = ("B", difference.spread) if difference.spread > 1 else ("A", 1 / difference.spread)
            return f"{noisier} is noisier: its std is {ratio:.2f} times the other's"
        case "bias":
            side = "farther" if difference.bias > 0 else "nearer"
            return f"B measures {side} than A, by {abs(difference.bias):.2f} spreads of the paper's sensor"
        case "missing":
            b, a = (100 * share for share in difference.holes)
            return f"{'B' if b > a else 'A'} has more holes: {a:.1f} % in A, {b:.1f} % in B"
        case "tail":
            return "the shares of far-off depths differ"
    return difference.words


def _describe(where: tuple[Cut, ...]) -> str:
    if not where:
        return "the two differ, but along no axis more than elsewhere"
    text = f"{where[0].text} ({place_in_words(where[0])})"
    other = next((cut for cut in where[1:] if cut.what != where[0].what), None)
    return text + (f"; besides, {other.text} ({place_in_words(other)})" if other else "")


def _notes(a: Evidence, b: Evidence, overlap: float) -> tuple[str, ...]:
    names = f"A is {a.run.path}, B is {b.run.path}"
    notes = [names, "no simulator takes part, so no causes are looked for: diagnose each against a profile for those"]
    if a.camera.shape != b.camera.shape:
        notes.append("the two have different resolutions: rows and columns are compared by their place in the picture")
    if overlap < 0.5:
        notes.append(f"only {overlap:.0%} of what they saw is alike in range and material; other pixels are left out")
    return tuple(notes)
