"""How the errors of single pixels are distributed, and how those of neighbours go together."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.report.figures import Picture, figure, png

Floats = NDArray[np.float32]
Frames = Callable[[int], list[NDArray[np.uint16]]]
_LAGS = 12
_CLIP = 5.0
_NEAR, _FAR = np.linspace(-5, 5, 81), np.linspace(-40, 40, 81)
_BLOCKS = 4
"""How many blocks of frames are looked at, which is plenty for a picture."""


@dataclass(frozen=True)
class Sample:
    """The errors of one sensor in some frames. error: (frames, height, width) in spreads of the simulator, NaN where
    there is no measurement or the scene may not be trusted. holes: share of the pixels that should have a depth.
    """

    name: str
    colour: str
    error: Floats
    block: NDArray[np.int64]
    holes: float


def sample(evidence: Evidence, name: str, colour: str, blocks: Sequence[int], frames: Frames) -> Sample:
    """The errors of the pictures that ``frames`` gives of each block."""
    chosen = list(blocks)[:: max(1, -(-len(blocks) // _BLOCKS))]
    errors, numbers, lost, wanted = [], [], 0, 0
    for block in chosen:
        for index, units in zip(evidence.blocks[block], frames(block), strict=True):
            still = evidence.stills[int(index)]
            clean = still.geometry.depth
            asked = clean > 0
            mask = evidence.run.mask(int(index))
            if mask is not None:
                asked &= mask
            valid = asked & (units > 0) & (units < 65535)
            depth = units * np.float32(evidence.camera.depth_scale)
            error = (depth - clean) * still.per_spread.reshape(clean.shape)
            errors.append(np.where(valid, error, np.nan).astype(np.float32))
            numbers.append(block)
            wanted += int(asked.sum())
            lost += int((asked & ~valid).sum())
    return Sample(name, colour, np.stack(errors), np.array(numbers), lost / max(wanted, 1))


def errors_picture(samples: Sequence[Sample]) -> Picture:
    """Histograms of the errors, near and far."""
    with figure(9.6, 3.0) as drawn:
        for k, (ax, edges) in enumerate(zip(drawn.subplots(1, 2), (_NEAR, _FAR), strict=True)):
            for one in samples:
                values = one.error[np.isfinite(one.error)]
                share = np.histogram(values, edges)[0] / max(values.size, 1) / np.diff(edges)
                share = np.where(share > 0, share, np.nan) if k else share
                style = "--" if "causes" in one.name else "-"
                label = f"{one.name}, {100 * one.holes:.1f} % holes"
                ax.stairs(share, edges, color=one.colour, lw=1.6, ls=style, label=label, baseline=None)
            ax.set(xlabel="error [x spread of the simulator]", ylabel="density", title=("the core", "the tails")[k])
            ax.grid(True)
            if k:
                ax.set_yscale("log")
            else:
                ax.set_ylim(bottom=0)
                handles, names = ax.get_legend_handles_labels()
        drawn.legend(handles, names, loc="outside upper left", ncols=len(names))
        return Picture(
            png(drawn), "All errors together, as densities. Left on a linear scale, right on a logarithmic one."
        )


def correlation_picture(samples: Sequence[Sample]) -> Picture:
    """How errors of pixels some way apart, and of the same pixel in successive frames, are correlated."""
    with figure(9.6, 2.8) as drawn:
        axes = drawn.subplots(1, 3, sharey=True)
        for one in samples:
            style = "--" if "causes" in one.name else "-"
            for ax, values in zip(axes, _correlations(one), strict=True):
                ax.plot(range(len(values)), values, style, marker="o", ms=3, lw=1.6, color=one.colour, label=one.name)
        for ax, title in zip(axes, ("along a row [px]", "along a column [px]", "successive frames"), strict=True):
            ax.set(xlabel=f"distance {title}" if "px" in title else "frames apart")
            ax.axhline(0, color="#9aa5b1", lw=0.8, zorder=1)
            ax.grid(True)
        axes[0].set_ylabel("correlation of the errors")
        axes[2].set_xticks(range(_frames_apart(samples[0]) + 1))
        handles, names = axes[0].get_legend_handles_labels()
        drawn.legend(handles, names, loc="outside upper left", ncols=len(names))
        return Picture(png(drawn), "How the errors of neighbouring pixels, and of one pixel in time, go together.")


def _frames_apart(one: Sample) -> int:
    return int(min(np.bincount(one.block).max() - 1, 4))


def _correlations(one: Sample) -> tuple[Floats, Floats, Floats]:
    e = np.clip(one.error, -_CLIP, _CLIP)
    rows = [1.0] + [_correlation(e[:, :, k:], e[:, :, :-k]) for k in range(1, min(_LAGS, e.shape[2] - 1) + 1)]
    columns = [1.0] + [_correlation(e[:, k:], e[:, :-k]) for k in range(1, min(_LAGS, e.shape[1] - 1) + 1)]
    times = [1.0]
    for k in range(1, _frames_apart(one) + 1):
        same = one.block[k:] == one.block[:-k]
        times.append(_correlation(e[k:][same], e[:-k][same]))
    return tuple(np.array(values, np.float32) for values in (rows, columns, times))  # type: ignore[return-value]


def _correlation(a: Floats, b: Floats) -> float:
    both = np.isfinite(a) & np.isfinite(b)
    x, y = a[both].astype(np.float64), b[both].astype(np.float64)
    if x.size < 2 or x.std() == 0 or y.std() == 0:
        return float("nan")
    return float(np.mean((x - x.mean()) * (y - y.mean())) / (x.std() * y.std()))
