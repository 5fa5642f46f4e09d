"""The histograms of a run: how its errors are distributed, given each of the axes that they may depend on.

For every axis (a covariate or a pair of them, cut into cells) and every cell, a histogram: of the error in units of the
simulator's own spread, of its difference from the neighbours', of its value beside that of a pixel some way off or of
the frame before, of the place between the two depths of an edge, of the fraction of the disparity. A hole
is a bin like the others. The square roots of the shares have the same variance in every bin (1/4n), so the distance
between two sets of histograms needs no weights, and least squares on them is close to maximum likelihood.
"""

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import kernel
from depthsim.lanes import choose, load_floats, magnitude, spread, store

_f = np.float32
ERROR, LEFT, UP, FAR_LEFT, FAR_UP, BEFORE, ACROSS, PHASE = range(8)
"""What is counted in an axis's cells; PHASE + k is the fraction of the disparity in the k-th of some steps."""
STEPS = (1 / 32, 1 / 16, 1 / 8, 1 / 4, 1 / 2, 1.0)
"""[px] The usual ones; a recording that has others may have one more."""

MAGNITUDES = np.array([0.15, 0.4, 0.7, 1, 1.35, 1.7, 2.1, 2.6, 3.3, 4.5, 6.5, 10, 16, 30, 70], np.float32)
ERROR_HOLE, ERROR_SATURATED, ERROR_NO_SURFACE = 32, 33, 34
APART = np.array([0.1, 0.3, 0.6, 1, 1.5, 2.2, 3.2, 5, 10, 30], np.float32)
_MIXES = np.array([-0.3, -0.1, 0.1, 0.3, 0.5, 0.7, 0.9, 1.1], np.float32)
_PHASES = 12
BINS = np.array([35, 26, 26, 28, 28, 28, 10] + [_PHASES + 1] * (len(STEPS) + 1), np.int64)
"""How many bins each kind of histogram has."""
_HALF = _f(0.70710677)
_LANES = 32
_NO_MEASUREMENT = 5


def _signed(sizes: NDArray[np.float32]) -> NDArray[np.float32]:
    """Thresholds on both sides of zero; a value on one of them falls into the bin nearer to zero."""
    return np.concatenate([np.nextafter(-sizes[::-1], _f(-np.inf)), np.zeros(1, np.float32), sizes])


_COARSE = _signed(np.array([0.3, 1], np.float32))[[0, 1, 3, 4]]


@kernel
def errors(units, unit, clean, per_spread, error, coarse):  # noqa: ANN201 - numba
    """error = (measured - clean) · per_spread, and its bin of five, or 5 where nothing is measured; flat arrays."""
    for i in range(units.size):
        raw, true, scale = units[i], clean[i], per_spread[i]
        ok = (raw > 0) & (raw < 65535) & (true > _f(0))
        off = (_f(raw) * unit - true) * scale
        e = off if ok else _f(0)
        error[i] = e
        k = np.uint8(e > _COARSE[0]) + np.uint8(e > _COARSE[1]) + np.uint8(e > _COARSE[2]) + np.uint8(e > _COARSE[3])
        coarse[i] = k if ok else np.uint8(_NO_MEASUREMENT)


@kernel
def _rank(values, thresholds, out):
    """How many thresholds each value is above; both arrays without gaps."""
    at, to = np.int64(values.ctypes.data), np.int64(out.ctypes.data)
    # The last lanes are done twice where they do not come out even.
    for begin in range(0, values.size if values.size >= _LANES else 0, _LANES):
        u = min(begin, values.size - _LANES)
        given, above = load_floats(at + 4 * u, _LANES), spread(np.uint8(0), _LANES)
        for threshold in thresholds:
            above = above + choose(given > threshold, np.uint8(1), np.uint8(0))
        store(to + u, above)
    for u in range(values.size if values.size < _LANES else 0):
        out[u] = np.uint8(0)
        for threshold in thresholds:
            out[u] += np.uint8(values[u] > threshold)


@kernel
def _signed_rank(values, sizes, out):
    """As :func:`_rank`, of the thresholds :func:`_signed` makes of ``sizes``: by their size, and then by their sign."""
    at, to, middle = np.int64(values.ctypes.data), np.int64(out.ctypes.data), np.uint8(sizes.size)
    for begin in range(0, values.size if values.size >= _LANES else 0, _LANES):
        u = min(begin, values.size - _LANES)
        given, beyond = load_floats(at + 4 * u, _LANES), spread(np.uint8(0), _LANES)
        size = magnitude(given)
        for threshold in sizes:
            beyond = beyond + choose(size > threshold, np.uint8(1), np.uint8(0))
        store(to + u, choose(given > _f(0), beyond + np.uint8(middle + 1), middle - beyond))
    for u in range(values.size if values.size < _LANES else 0):
        beyond = np.uint8(0)
        for threshold in sizes:
            beyond += np.uint8(abs(values[u]) > threshold)
        out[u] = middle + np.uint8(1) + beyond if values[u] > _f(0) else middle - beyond


@kernel
def _error(e, raw, true, out):
    _signed_rank(e, MAGNITUDES, out)
    # Here and below: read first and choose then, one choice a line, see kernel.
    for u in range(e.size):
        units, surface, rank = raw[u], true[u], out[u]
        found = np.uint8(33) if units == 65535 else rank
        found = np.uint8(32) if units == 0 else found
        beside = np.uint8(32) if units == 0 else np.uint8(34)
        out[u] = found if surface > _f(0) else beside


@kernel
def _across(raw, unit, true, beyond, coarse, by, out):
    for u in range(raw.size):
        by[u] = (_f(raw[u]) * unit - true[u]) / (beyond[u] - true[u])
    _rank(by, _MIXES, out)
    for u in range(raw.size):
        kind, rank = coarse[u], out[u]
        out[u] = rank if kind < _NO_MEASUREMENT else np.uint8(9)


@kernel
def _phase(disparity, per_step, coarse, out):
    for u in range(disparity.size):
        steps = disparity[u] * per_step
        phase = np.uint8(np.int32((steps - np.floor(steps)) * _f(_PHASES)))
        out[u] = phase if coarse[u] < _NO_MEASUREMENT else np.uint8(_PHASES)


@kernel
def _difference(e, raw, other_e, other_raw, by, out):
    for u in range(e.size):
        by[u] = (e[u] - other_e[u]) * _HALF
    _signed_rank(by[: e.size], APART, out)
    for u in range(e.size):
        units, others, rank = raw[u], other_raw[u], out[u]
        here, there = units > 0, others > 0
        found = np.uint8(22) if units == others else rank
        holes = np.uint8(23) if here else (np.uint8(24) if there else np.uint8(25))
        out[u] = found if here & there else holes


@kernel
def _pair(one, other, out):
    for u in range(one.size):
        a, b = one[u], other[u]
        holes = np.uint8(25) if a < 5 else (np.uint8(26) if b < 5 else np.uint8(27))
        out[u] = np.uint8(a * np.uint8(5) + b) if (a < 5) & (b < 5) else holes


@kernel
def codes(  # noqa: ANN201 - numba
    units, unit, clean, across, focal_baseline, width, error, coarse, coarse_before, left, up, steps, rows, out
):  # fmt: skip
    """The bin of each pixel in each kind of histogram, for some rows.

    out: (kinds, pixels of those rows) uint8. What has no bin, such as the difference from a neighbour beyond the
    border, is left as it is: :func:`depthsim.gap.depth.data.counting.places` sees to it that it is counted nowhere.
    coarse_before is empty where there is no frame before. left, up: how far off the pixel is that FAR_LEFT and FAR_UP
    compare with [px]. steps: (any number,) [px].
    """
    by = np.empty(width, np.float32)
    for row in range(rows.size):
        v = rows[row]
        begin, end, at, till = v * width, (v + 1) * width, row * width, (row + 1) * width
        e, raw, true, c = error[begin:end], units[begin:end], clean[begin:end], coarse[begin:end]
        _error(e, raw, true, out[0, at:till])
        _difference(e[1:], raw[1:], e[:-1], raw[:-1], by, out[1, at + 1 : till])
        if v >= 1:
            _difference(e, raw, error[begin - width : begin], units[begin - width : begin], by, out[2, at:till])
        _pair(c[left:], c[:-left], out[3, at + left : till])
        if v >= up:
            _pair(c, coarse[begin - up * width : end - up * width], out[4, at:till])
        if coarse_before.size > 0:
            _pair(c, coarse_before[begin:end], out[5, at:till])
        _across(raw, unit, true, across[begin:end], c, by, out[6, at:till])
        for u in range(width):
            by[u] = focal_baseline / (_f(raw[u]) * unit)
        for k in range(steps.size):
            _phase(by, _f(1) / steps[k], c, out[7 + k, at:till])
