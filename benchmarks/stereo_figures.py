"""The figures by which a stereo camera's depth is described, from real frames and simulated ones alike."""

import numpy as np
from numpy.typing import NDArray

Picture = NDArray[np.float32]
PATCH = 25
"""[px] Side of the squares that noise is measured in."""


def patches(disparity: Picture, mask: NDArray[np.bool_] | None = None) -> tuple[NDArray, NDArray]:
    """(N, 25, 25) residuals of whole, valid squares from a plane fit each, and their (N, 2) first row and column."""
    good = (disparity > 0) if mask is None else (disparity > 0) & mask
    v, u = np.mgrid[:PATCH, :PATCH] - PATCH // 2
    basis = np.stack([np.ones(PATCH * PATCH), u.ravel(), v.ravel()], axis=1)
    solve = np.linalg.pinv(basis)
    found, places = [], []
    for row in range(0, disparity.shape[0] - PATCH, PATCH):
        for column in range(0, disparity.shape[1] - PATCH, PATCH):
            part = np.s_[row : row + PATCH, column : column + PATCH]
            if good[part].all():
                values = disparity[part].ravel().astype(float)
                found.append((values - basis @ (solve @ values)).reshape(PATCH, PATCH))
                places.append((row, column))
    return np.array(found).reshape(-1, PATCH, PATCH), np.array(places).reshape(-1, 2)


def local_noise(disparity: Picture, mask: NDArray[np.bool_] | None = None) -> float:
    """Median over squares of the std of disparity about a plane [px]; not a number without a whole square."""
    found, _ = patches(disparity, mask)
    return float(np.median(found.std(axis=(1, 2)))) if len(found) else float("nan")


def correlation_lengths(residual: Picture, valid: NDArray[np.bool_]) -> tuple[float, float]:
    """Lag at which the autocorrelation of a residual falls to a half, along rows and along columns [px]."""
    values = np.where(valid, residual - np.mean(residual[valid]), 0)
    return _half(values, valid), _half(values.T, valid.T)


def _half(values: NDArray, valid: NDArray[np.bool_]) -> float:
    power = float((values**2).sum() / valid.sum())
    before = 1.0
    for lag in range(1, 60):
        both = valid[:, lag:] & valid[:, :-lag]
        now = float((values[:, lag:] * values[:, :-lag])[both].mean() / power)
        if now < 0.5:
            return lag - 1 + (before - 0.5) / (before - now)
        before = now
    return float("inf")


def invalid_band(disparity: Picture) -> tuple[NDArray, NDArray]:
    """Per row the holes at the left border [px], and the disparity just right of them, where 15 pixels are whole."""
    widths, found = [], []
    for row in disparity:
        first = int(np.argmax(row > 0))
        part = row[first : first + 15]
        if part.size == 15 and (part > 0).all():
            widths.append(first)
            found.append(float(np.median(part)))
    return np.array(widths), np.array(found)


def edge_gaps(disparity: Picture, least: float = 3.0, longest: int = 80) -> tuple[NDArray, NDArray, NDArray, NDArray]:
    """Holes between two surfaces along the rows: width and step on the left of near objects, then on their right.

    least: smallest step of disparity that counts [px]. A jump without a hole has width 0.
    """
    left_width, left_step, right_width, right_step = [], [], [], []
    for row in disparity:
        at = np.flatnonzero(row > 0)
        if at.size < 2:
            continue
        gap, step = np.diff(at) - 1, np.diff(row[at])
        for width, change in zip(gap, step, strict=True):
            if abs(change) < least or width > longest:
                continue
            (left_width if change > 0 else right_width).append(width)
            (left_step if change > 0 else right_step).append(abs(change))
    return tuple(np.array(x, float) for x in (left_width, left_step, right_width, right_step))  # type: ignore[return-value]


def in_between(disparity: Picture, reach: int = 4, least: float = 3.0) -> float:
    """Share of the valid pixels near edges that are well between the surfaces ``reach`` pixels to both sides."""
    near, middle, far = disparity[:, : -2 * reach], disparity[:, reach:-reach], disparity[:, 2 * reach :]
    edge = (near > 0) & (middle > 0) & (far > 0) & (np.abs(near - far) > least)
    low, high = np.minimum(near, far), np.maximum(near, far)
    margin = 0.25 * (high - low)
    between = edge & (middle > low + margin) & (middle < high - margin)
    return float(between.sum() / max(edge.sum(), 1))


def ramp(pictures: list[Picture], least: float, most: float, reach: int = 4) -> tuple[float, float]:
    """Of the places amid a step of ``least`` to ``most`` [px] over 2 ``reach`` pixels of a row: of those with depth the
    share that is well in between, and the share of holes."""
    between = holes = count = 0
    for picture in pictures:
        ends, middle = np.stack([picture[:, : -2 * reach], picture[:, 2 * reach :]]), picture[:, reach:-reach]
        step = np.abs(ends[0] - ends[1])
        edge = (ends > 0).all(axis=0) & (step >= least) & (step < most)
        between += int((edge & (np.abs(middle - ends.mean(axis=0)) < 0.25 * step)).sum())
        holes += int((edge & (middle <= 0)).sum())
        count += int(edge.sum())
    return between / max(count - holes, 1), holes / max(count, 1)


def bare_jumps(disparity: Picture, least: float = 3.0) -> tuple[int, int]:
    """Jumps without a hole, from far to near and from near to far, going right."""
    a, b = disparity[:, :-1], disparity[:, 1:]
    both = (a > 0) & (b > 0)
    return int((both & (b - a > least)).sum()), int((both & (a - b > least)).sum())


def plane_residual(disparity: Picture, mask: NDArray[np.bool_] | None = None) -> tuple[Picture, NDArray[np.bool_]]:
    """Residual from the plane of disparity that fits best, and where it is good; gross errors are left out."""
    good = (disparity > 0) if mask is None else (disparity > 0) & mask
    v, u = np.mgrid[: disparity.shape[0], : disparity.shape[1]]
    basis = np.stack([np.ones(disparity.size), u.ravel() / 100, v.ravel() / 100], axis=1)
    flat = disparity.ravel().astype(float)
    for _ in range(4):
        use = np.flatnonzero(good)
        plane = np.linalg.lstsq(basis[use], flat[use], rcond=None)[0]
        residual = (flat - basis @ plane).reshape(disparity.shape)
        good = good & (np.abs(residual) < 1.0)
    return residual.astype(np.float32), good


def local_residual(disparity: Picture, mask: NDArray[np.bool_], size: int = 65) -> tuple[Picture, NDArray[np.bool_]]:
    """Residual from a plane and then from the mean over squares of ``size``, and where it is good."""
    from scipy.ndimage import uniform_filter

    residual, good = plane_residual(disparity, mask)
    share = uniform_filter(good.astype(float), size)
    mean = uniform_filter(np.where(good, residual, 0).astype(float), size) / np.maximum(share, 1e-9)
    return (residual - mean).astype(np.float32), good
