"""How much the errors of neighbouring pixels and of successive frames go together, whatever their spread is."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data import histograms
from depthsim.gap.depth.data.evidence import Counts
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import Effect

HISTOGRAMS = {"pixel_neighbours": (histograms.LEFT, histograms.UP), "frame_neighbours": (histograms.BEFORE,)}
"""The histograms by which each is known."""
_COARSE = 5
_EQUAL = 2 * len(histograms.APART) + 2


def brought(validator: Validator, axis: str, before: Sequence[Effect], after: Sequence[Effect]) -> float:
    """By how much the correlation of ``after`` is farther from the recording's than that of ``before``.

    axis: a key of :data:`HISTOGRAMS`.
    """
    off = [np.abs(_more(validator, effects, axis)).max() for effects in (before, after)]
    return float(off[1] - off[0])


def apart(validator: Validator, axis: str) -> float:
    """By how much the recording's errors do not go together, by the pairs of which they do most: 1 less a correlation.

    Where neighbours go together by 0.99 as it is, hundredths are all that an effect can change that by.
    """
    return float(1 - _correlations(validator, validator.real.sum(axis=0), axis).max())


def lacking(validator: Validator, axis: str, effects: Sequence[Effect]) -> float:
    """By how much more the recording's errors go together than those of ``effects``."""
    return float(_more(validator, effects, axis).max())


def _more(validator: Validator, effects: Sequence[Effect], axis: str) -> NDArray[np.float64]:
    return _correlations(validator, validator.real.sum(axis=0), axis) - _simulated(validator, effects, axis)


def _simulated(validator: Validator, effects: Sequence[Effect], axis: str) -> NDArray[np.float64]:
    return _correlations(validator, validator.runs(effects, 1)[0].sum(axis=0), axis)


def _correlations(validator: Validator, counts: Counts, axis: str) -> NDArray[np.float64]:
    """(kinds,) of each kind of pairs that an axis has."""

    def of(kind: int) -> float:
        pairs = counted(validator, counts, kind)
        return _of_table(pairs) if kind == histograms.BEFORE else _of_differences(pairs, errors)

    errors = counted(validator, counts, histograms.ERROR)
    return np.array([of(kind) for kind in HISTOGRAMS[axis]])


def counted(validator: Validator, counts: Counts, kind: int) -> NDArray[np.float64]:
    """(bins,) of the first axis that counts this kind: all pixels, or all beside another one."""
    evidence = validator.evidence
    number = next(n for n, axis in enumerate(evidence.axes) if axis.kind == kind)
    return np.asarray(evidence.cells(number, counts).sum(axis=0), np.float64)


def _of_differences(differences: NDArray[np.float64], errors: NDArray[np.float64]) -> float:
    """1 less the ratio of the variances, by medians: a difference over the root of 2 is as wide as an error that goes
    together with no other."""
    near = _middle(errors[: 2 * len(histograms.MAGNITUDES) + 2], histograms.MAGNITUDES)
    apart = differences[:_EQUAL].copy()
    apart[_EQUAL // 2] += differences[_EQUAL]
    return 1 - (_middle(apart, histograms.APART) / near) ** 2


def _middle(counts: NDArray[np.float64], sizes: NDArray[np.float32]) -> float:
    """The median size of what is counted in bins to both sides of 0, with bounds at ``sizes``."""
    half = len(counts) // 2
    shares = np.cumsum(counts[half:] + counts[half - 1 :: -1])
    bounds = np.concatenate([[0], sizes])
    return float(np.interp(0.5, np.concatenate([[0], shares[:-1]]) / max(shares[-1], 1), bounds))


def _of_table(pairs: NDArray[np.float64]) -> float:
    """The correlation of two errors that are counted in five bins each."""
    table = pairs[: _COARSE**2].reshape(_COARSE, _COARSE)
    place = np.arange(_COARSE) - _COARSE // 2
    share = table / max(table.sum(), 1)
    one, other = share.sum(axis=1), share.sum(axis=0)
    a, b = place - one @ place, place - other @ place
    return float(a @ share @ b / np.sqrt(max((one @ a**2) * (other @ b**2), 1e-12)))
