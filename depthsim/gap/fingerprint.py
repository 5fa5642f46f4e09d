"""The fingerprint of a run: how its errors are distributed, given each of the axes that they may depend on.

For every view (an axis or a pair of axes, cut into cells) and every cell, a histogram: of the error in units of the
simulator's own spread, of its difference from the neighbours', of its value beside that of a pixel some way off or of
the frame before, of the place between the two depths of an edge, of the fraction of the disparity. What has no return
is a bin like the others. The square roots of the shares have the same variance in every bin (1/4n), so the distance
between two fingerprints needs no weights, and least squares on them is close to maximum likelihood.
"""

import numpy as np

from depthsim.kernels import inlined, kernel

_f = np.float32
NO_CELL = np.uint16(65535)
ERROR, LEFT, UP, FAR_LEFT, FAR_UP, BEFORE, ACROSS, PHASE = range(8)
"""What is counted in a view's cells; PHASE + k is the fraction of the disparity in steps of STEPS[k]."""
STEPS = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
_STEPS = np.array(STEPS, np.float32)

MAGNITUDES = np.array([0.15, 0.4, 0.7, 1, 1.35, 1.7, 2.1, 2.6, 3.3, 4.5, 6.5, 10, 16, 30, 70], np.float32)
ERROR_LOST, ERROR_SATURATED, ERROR_NO_SURFACE = 32, 33, 34
_DIFFERENCES = np.array([0.1, 0.3, 0.6, 1, 1.5, 2.2, 3.2, 5, 10, 30], np.float32)
_MIXES = np.array([-0.3, -0.1, 0.1, 0.3, 0.5, 0.7, 0.9, 1.1], np.float32)
_PHASES = 12
BINS = np.array([35, 26, 26, 28, 28, 28, 10] + [_PHASES + 1] * len(STEPS), np.int64)
"""How many bins each kind of histogram has."""
_LAG_LEFT, _LAG_UP = 5, 4


@inlined
def _signed_bin(value, thresholds):
    """0 … 2·len + 1: from the largest negative to the largest positive; what is not a number counts as 0."""
    size = abs(value)
    k = 0
    for threshold in thresholds:
        k += 1 if size > threshold else 0
    count = thresholds.size
    return count + 1 + k if value > _f(0) else count - k


@inlined
def _coarse(e):
    return 0 if e < _f(-1) else (1 if e < _f(-0.3) else (2 if e <= _f(0.3) else (3 if e <= _f(1) else 4)))


@inlined
def _pair(a, valid_a, b, valid_b):
    if valid_a and valid_b:
        return _coarse(a) * 5 + _coarse(b)
    return 25 if valid_a else (26 if valid_b else 27)


@inlined
def _difference(a, raw_a, b, raw_b):
    if raw_a > 0 and raw_b > 0:
        return 22 if raw_a == raw_b else _signed_bin((a - b) * _f(0.70710677), _DIFFERENCES)
    return 23 if raw_a > 0 else (24 if raw_b > 0 else 25)


@kernel
def errors(units, unit, clean, per_spread, error, valid):  # noqa: ANN201 - numba
    """error = (measured - clean) · per_spread, and whether there is a measurement; flat arrays."""
    for i in range(units.size):
        ok = units[i] > 0 and units[i] < 65535 and clean[i] > _f(0)
        valid[i] = 1 if ok else 0
        error[i] = (_f(units[i]) * unit - clean[i]) * per_spread[i] if ok else _f(0)


@inlined
def _find_bins(
    i, units, unit, clean, across, focal_baseline, width, error, valid, error_before, valid_before, bins
):  # fmt: skip
    """The bin of one pixel in each kind of histogram; -1 where it has none."""
    u, v = i % width, i // width
    raw, e, ok = units[i], error[i], valid[i] > 0
    if clean[i] == _f(0):
        bins[0] = 34 if raw > 0 else 32
    else:
        bins[0] = 32 if raw == 0 else (33 if raw == 65535 else _signed_bin(e, MAGNITUDES))
    bins[1] = _difference(e, raw, error[i - 1], units[i - 1]) if u > 0 else -1
    bins[2] = _difference(e, raw, error[i - width], units[i - width]) if v > 0 else -1
    bins[3] = _pair(e, ok, error[i - _LAG_LEFT], valid[i - _LAG_LEFT] > 0) if u >= _LAG_LEFT else -1
    bins[4] = _pair(e, ok, error[i - _LAG_UP * width], valid[i - _LAG_UP * width] > 0) if v >= _LAG_UP else -1
    bins[5] = _pair(e, ok, error_before[i], valid_before[i] > 0) if error_before.size > 0 else -1
    bins[6] = -1
    if across[i] > _f(0):
        bins[6] = 9
        if ok:
            share = (_f(raw) * unit - clean[i]) / (across[i] - clean[i])
            k = 0
            for threshold in _MIXES:
                k += 1 if share > threshold else 0
            bins[6] = k
    disparity = focal_baseline / (_f(raw) * unit) if ok else _f(0)
    for k in range(_STEPS.size):
        steps = disparity / _STEPS[k]
        bins[7 + k] = min(np.int64((steps - np.floor(steps)) * _f(_PHASES)), _PHASES) if ok else _PHASES


@kernel
def count(  # noqa: ANN201 - numba
    units, unit, clean, across, focal_baseline, width, error, valid, error_before, valid_before, first, stride, cells,
    kinds, offsets, counts,
):  # fmt: skip
    """Add every ``stride``-th row of a frame, from row ``first`` on, to ``counts``.

    cells: (pixels of those rows, views); error_before is empty where there is no frame before.
    """
    bins = np.zeros(13, np.int64)
    for k in range(cells.shape[0]):
        i = (first + k // width * stride) * width + k % width
        _find_bins(
            i, units, unit, clean, across, focal_baseline, width, error, valid, error_before, valid_before, bins
        )  # fmt: skip
        for w in range(kinds.size):
            cell, found = cells[k, w], bins[kinds[w]]
            if cell != NO_CELL and found >= 0:
                counts[offsets[w] + np.int64(cell) * BINS[kinds[w]] + found] += np.uint32(1)


@kernel
def count_corrected(  # noqa: ANN201 - numba
    units, unit, clean, across, focal_baseline, width, error, valid, error_before, valid_before, first, stride, cells,
    kinds, offsets, counts, view, ratio, excess, most,
):  # fmt: skip
    """As :func:`count`, corrected along one view; counts are float64.

    Each pixel has the weight ``ratio`` of its bin there; ``excess`` is the share of the bins that the simulator
    (almost) never fills, which no weight could bring: every pixel of the cell gets it in the views of the same kind.
    most: (cells,) the number of such bins.
    """
    bins = np.zeros(13, np.int64)
    many = BINS[kinds[view]]
    for k in range(cells.shape[0]):
        i = (first + k // width * stride) * width + k % width
        _find_bins(
            i, units, unit, clean, across, focal_baseline, width, error, valid, error_before, valid_before, bins
        )  # fmt: skip
        own, found = cells[k, view], bins[kinds[view]]
        weight, extra = 1.0, False
        if own != NO_CELL and found >= 0:
            weight, extra = ratio[np.int64(own) * many + found], most[own] > 0
        for w in range(kinds.size):
            cell, found = cells[k, w], bins[kinds[w]]
            if cell != NO_CELL and found >= 0:
                at = offsets[w] + np.int64(cell) * BINS[kinds[w]]
                counts[at + found] += weight
                if extra and kinds[w] == kinds[view]:
                    for b in range(many):
                        counts[at + b] += excess[np.int64(own) * many + b]
