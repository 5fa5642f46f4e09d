"""The bias that a camera has at the same pixels in every frame, learned from a recording.

What a pixel's disparity is off by, averaged over frames, holds the pattern and noise. What the averages of two parts
of the frames have in common is the pattern alone: its variance, and the lag at which its correlation is a half. These
two make it a Gaussian process, of which the averages are noisy values; the grid is its posterior mean (kriging), which
is shrunk to 0 where the averages say little. Whatever a turned mount, a scale or an offset explains as well is left to
them.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import distort
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.rigid import Floats, Frame, Look
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.sensor.effects.fixed_pattern import FixedPattern, picture, spline

_SAMPLES = 20_000
"""Pixels that are looked at in a frame, about."""
_LEAST_FRAMES, _MOST_FRAMES = 6, 80
_CHUNKS = 8
"""Stretches of time. Those of the first three eighths are compared with the last three, as noise too lasts a while."""
_ROUNDS = 4
_TUKEY = 4.685
_FAR = 12.0
"""Of the median size of the pixels' biases: eight standard deviations, if they were normal."""
_LEAST_NOISE = 0.005
_MOST_KNOTS = 768
"""In all: columns that differ and rows that do not want many across and few down."""
_SURE = 3.0
"""A pattern removes this many standard errors of what it removes, or there is none."""
_FAINT = 0.01
"""Nor is there one that removes a smaller share."""


@dataclass(frozen=True)
class Pattern:
    """A learned pattern.

    grid: (rows, columns) [px], spread over the picture as :class:`FixedPattern` does. amplitude: its root mean square
    over the picture [px]. found: the same of the pattern itself, of which the grid is what is sure. size: lag at which
    its correlation is a half [px], between that down and that across. noise: spread of a pixel's errors
    about what repeats [px]. removed, removed_error: the share of
    the errors' variance that a grid learned on half of the frames removes from the other, and its standard error.
    """

    grid: Floats
    amplitude: float
    found: float
    size: float
    noise: float
    removed: float
    removed_error: float

    @property
    def is_none(self) -> bool:
        """Whether it removes no more than chance from frames that it was not learned on."""
        return self.amplitude == 0 or self.removed < max(_SURE * self.removed_error, _FAINT)

    def effect(self) -> FixedPattern:
        """The effect that has this grid."""
        rows = tuple(tuple(float(f"{value:.4g}") for value in row) for row in self.grid)
        low, high = 1.0, 1000.0
        size = float(np.clip(self.size, low, high))
        return FixedPattern(amplitude=min(self.amplitude, 10.0), size=size, grid=rows)


def learn_pattern(evidence: Evidence) -> Pattern | None:
    """The pattern of the frames for fitting; None where there is none, or too few of them."""
    frames = [int(i) for block in evidence.train for i in evidence.blocks[block]]
    if len(frames) < _LEAST_FRAMES:
        return None
    found = learn(evidence.run, evidence.caster, frames)
    return None if found.is_none else found


def learn(run: Run, caster: Caster, frames: Iterable[int] | None = None) -> Pattern:
    """The pattern of ``frames`` (all of them by default; some of many), against the scene.

    The poses should be registered first: a pattern is what they leave alike in all frames.
    """
    every = sorted(set(range(len(run)) if frames is None else frames))
    some = [every[k] for k in np.unique(np.linspace(0, len(every) - 1, _MOST_FRAMES).round().astype(int))]
    return _Learner(run, caster, some).learned()


@dataclass
class _Sums:
    """Over frames, at each pixel: of the weights, of weight · error, and of weight · error²."""

    weight: Floats
    error: Floats
    square: Floats

    def __add__(self, other: "_Sums") -> "_Sums":
        return _Sums(self.weight + other.weight, self.error + other.error, self.square + other.square)

    def left(self, pattern: Floats) -> float:
        """Weighted sum of squares about a pattern."""
        return float(self.square.sum() - 2 * (self.error * pattern).sum() + (self.weight * pattern**2).sum())


class _Learner:
    def __init__(self, run: Run, caster: Caster, frames: Sequence[int]) -> None:
        self.look = Look.at(run, caster, _SAMPLES)
        for index in frames:
            self.look.load(index)
        self.look.cut_disparities(list(frames))
        self.left = run.camera.left  # whose pictures have the pattern, of an aligned camera too
        height, width = (max(n // self.look.stride, 1) for n in self.left.shape)
        self.shape = (height, width) if run.camera.aligned else self.look.camera.shape
        self.seen: list[tuple[Floats, Floats, NDArray[np.intp]]] = []
        self.beta: Floats
        self.center: Floats
        for index in frames:
            frame = self.look.frame(index, run.poses[index], np.zeros(6))
            self.seen.append(
                (
                    frame.residual,
                    np.column_stack([frame.rigid, np.ones_like(frame.disparity), frame.disparity]),
                    self._places(frame),
                )
            )
        self.priors = np.array([0.1] * 6 + [2.0, 0.1])
        self.chunks = np.array_split(np.arange(len(frames)), min(_CHUNKS, len(frames)))
        part = (3 * len(self.chunks) + 4) // 8
        self.ends = slice(0, part), slice(len(self.chunks) - part, None)

    def _places(self, frame: Frame) -> NDArray[np.intp]:
        """Where the pixels of a frame are in the left imager's picture, as numbers of its samples."""
        camera = self.look.run.camera
        if not camera.aligned:
            return frame.place
        z = camera.focal_baseline / frame.disparity
        x, y = self.look.rays.reshape(2, -1)[:, frame.place].astype(np.float64)
        to = np.linalg.inv(camera.left_pose)
        point = to[:3, :3] @ np.stack([x * z, y * z, z]) + to[:3, 3:]
        x, y = distort(point[0] / point[2], point[1] / point[2], self.left.distortion)
        at = np.stack([y * self.left.fy + self.left.cy, x * self.left.fx + self.left.cx]) // self.look.stride
        v, u = (np.clip(part, 0, n - 1).astype(np.intp) for part, n in zip(at, self.shape, strict=True))
        return np.asarray(v * self.shape[1] + u)

    def learned(self) -> Pattern:
        pattern = np.zeros(self.shape)
        self.beta = np.zeros(len(self.priors))
        for _ in range(_ROUNDS):
            self._fit_static(pattern.reshape(-1))
            sums = [self._sum(chunk) for chunk in self.chunks]
            found, size = self._size_of(sums)
            grid = self._krige(_total(sums), sums, found, size)
            pattern = picture(grid, self.shape)
        removed, error = self._removed(sums, found, size)
        return Pattern(
            grid=grid,
            amplitude=float(np.sqrt((picture(grid, self.left.shape) ** 2).mean())),
            found=found,
            size=float(np.sqrt(size.prod())) * self.look.stride,
            noise=self.scale,
            removed=removed,
            removed_error=error,
        )

    def _fit_static(self, pattern: Floats) -> None:
        """What a mount, a scale and an offset explain of what the pattern leaves."""
        self._center()
        matrix, right = np.diag(self.priors**-2.0), np.zeros(len(self.priors))
        for residual, nuisance, place in self.seen:
            target = residual - pattern[place]
            weight = self._weights(residual - nuisance @ self.beta, place)
            matrix += np.einsum("pi,p,pj->ij", nuisance, weight, nuisance, optimize=True) / self.scale**2
            right += nuisance.T @ (weight * target) / self.scale**2
        self.beta = np.asarray(np.linalg.solve(matrix, right), np.float64)
        self._center()

    def _center(self) -> None:
        """The median error of each pixel over the frames, NaN where it is far off, and the spread about it.

        A bias that repeats may be many times the noise; what is off by far more than the other pixels is a thing that
        the scene does not have.
        """
        errors = np.full((len(self.seen), self.shape[0] * self.shape[1]), np.nan)
        for k, (residual, nuisance, place) in enumerate(self.seen):
            errors[k, place] = residual - nuisance @ self.beta
        known = np.flatnonzero(np.isfinite(errors).any(axis=0))
        self.center = np.full(errors.shape[1], np.nan)
        if known.size:
            center = np.nanmedian(errors[:, known], axis=0)
            off = np.abs(center - np.median(center))
            self.center[known] = np.where(off <= _FAR * np.median(off), center, np.nan)
        left = np.abs(errors - self.center)
        left = left[np.isfinite(left)]
        # Not the median, which is 0 where depths have coarse steps.
        size = 1.2533 * float(np.minimum(left, np.quantile(left, 0.95)).mean()) if left.size else 0.0
        self.scale = max(size, _LEAST_NOISE)

    def _weights(self, error: Floats, place: NDArray[np.intp]) -> Floats:
        part = (error - self.center[place]) / (_TUKEY * self.scale)
        return np.where(np.abs(part) < 1, (1 - part**2) ** 2, 0)

    def _sum(self, chunk: NDArray[np.intp]) -> _Sums:
        pixels = self.shape[0] * self.shape[1]
        parts = [np.zeros(pixels) for _ in range(3)]
        for k in chunk:
            residual, nuisance, place = self.seen[k]
            error = residual - nuisance @ self.beta
            weight = self._weights(error, place)
            for part, value in zip(parts, (weight, weight * error, weight * error**2), strict=True):
                part[place] += value
        return _Sums(*(part.reshape(self.shape) for part in parts))

    def _size_of(self, sums: Sequence[_Sums]) -> tuple[float, Floats]:
        """Root mean square of the pattern [px], and the lags of half correlation down and across [samples].

        It is what both halves have in common.
        """
        a, b = (_total(sums[end]) for end in self.ends)
        both = (a.weight > 0) & (b.weight > 0)
        if np.count_nonzero(both) < 50:
            return 0.0, np.ones(2)
        first, second = (np.where(both, s.error / np.where(both, s.weight, 1), 0) for s in (a, b))
        weight = np.where(both, np.minimum(a.weight, b.weight), 0)
        products, weights = _correlate(weight * first, weight * second), _correlate(weight, weight)
        if products[0, 0] <= 0:
            return 0.0, np.ones(2)
        sizes = [
            _half(line(products)[: n // 2] / np.maximum(line(weights)[: n // 2], 1e-12))
            for line, n in zip((lambda x: x[:, 0], lambda x: x[0]), self.shape, strict=True)
        ]
        return float(np.sqrt(products[0, 0] / weights[0, 0])), np.array(sizes)

    def _krige(self, whole: _Sums, sums: Sequence[_Sums], found: float, size: Floats) -> Floats:
        """(rows, columns) the posterior mean at the knots, which lie two within the lag of half correlation."""
        seen = [np.flatnonzero((whole.weight > 0).sum(axis=axis)) for axis in (1, 0)]
        pixels = np.array(
            [np.ptp(places) + 1 if places.size else n for places, n in zip(seen, self.shape, strict=True)]
        )
        wanted = np.minimum(2 * pixels / size + 1, pixels)
        if wanted.prod() > _MOST_KNOTS:  # fewer in the direction that has more, and in both where that is not enough
            less = max(_MOST_KNOTS / wanted.prod(), wanted.min() / wanted.max())
            wanted[wanted.argmax()] *= less
            wanted *= min(np.sqrt(_MOST_KNOTS / wanted.prod()), 1)
        knots = [max(int(one), 3) for one in wanted * self.shape / pixels]
        if found == 0:
            return np.zeros(knots)
        steps = [(n - 1) / (k - 1) for k, n in zip(knots, self.shape, strict=True)]
        # What is beyond the pixels that are seen, of which an aligned camera's left imager has many, is 0.
        near = [
            np.flatnonzero((np.arange(k) * s > p.min() - 2 * s) & (np.arange(k) * s < p.max() + 2 * s))
            for k, s, p in zip(knots, steps, seen, strict=True)
        ]
        down, across = (spline(k, n)[:, some] for k, n, some in zip(knots, self.shape, near, strict=True))
        noise = self._noise_of(sums)
        gram = np.einsum("vi,vu,vk->iku", down, whole.weight, down, optimize=True)
        gram = np.einsum("iku,uj,ul->ijkl", gram, across, across, optimize=True)
        gram = gram.reshape(down.shape[1] * across.shape[1], -1)
        right = np.einsum("vi,vu,uj->ij", down, whole.error, across, optimize=True).reshape(-1)
        laws = [
            2.0 ** -((np.subtract.outer(some, some) * s / one) ** 2)
            for some, s, one in zip(near, steps, size, strict=True)
        ]
        prior = found**2 * np.kron(laws[0], laws[1])
        # (gram / noise + prior^-1)^-1 right / noise, without the inverse of a matrix that is nearly singular.
        solved = prior @ np.linalg.solve(gram @ prior + noise * np.eye(len(prior)), right)
        grid = np.zeros(knots)
        grid[np.ix_(*near)] = solved.reshape(down.shape[1], across.shape[1])
        return grid

    def _noise_of(self, sums: Sequence[_Sums]) -> float:
        """[px²] the noise's variance per frame, times the pixels over which it is correlated."""
        a, b = (_total(sums[end]) for end in self.ends)
        both = (a.weight > 0) & (b.weight > 0)
        per = np.where(both, 1 / np.where(both, a.weight, 1) + 1 / np.where(both, b.weight, 1), 1)
        apart = np.where(both, a.error / np.where(both, a.weight, 1) - b.error / np.where(both, b.weight, 1), 0)
        return max(self._over_area(apart / np.sqrt(per), both), _LEAST_NOISE**2)

    def _over_area(self, values: Floats, known: NDArray[np.bool_]) -> float:
        """The sum of the covariances of ``values`` over the lags; at least the variance."""
        products, counts = _correlate(values, values), _correlate(known.astype(float), known.astype(float))
        reach = [min(12, n // 4) for n in self.shape]
        near = np.ix_(*(np.r_[0 : r + 1, -r:0] for r in reach))
        law = products[near] / np.maximum(counts[near], 1)
        return float(max(law.sum(), law[0, 0]))

    def _removed(self, sums: Sequence[_Sums], found: float, size: Floats) -> tuple[float, float]:
        """The chunks of each end judged by the grid of the other end's."""
        gains, wholes = [], []
        for own, other in (self.ends, self.ends[::-1]):
            pattern = picture(self._krige(_total(sums[other]), sums, found, size), self.shape)
            wholes += [s.left(np.zeros(self.shape)) for s in sums[own]]
            gains += [s.left(np.zeros(self.shape)) - s.left(pattern) for s in sums[own]]
        gain, whole = np.array(gains), np.maximum(wholes, 1e-30)
        held = (gain.sum() - gain) / (whole.sum() - whole) if len(gain) > 1 else np.zeros(1)
        removed = float(gain.sum() / whole.sum())
        return removed, float(np.sqrt((1 - 1 / len(gain)) * np.square(held - removed).sum()))


def _half(law: Floats) -> float:
    """The lag at which a correlation is a half of what it is at none; at least 1."""
    below = np.flatnonzero(law < law[0] / 2)
    if not below.size:
        return float(max(len(law) - 1, 1))
    k = int(below[0])
    return float(max(k - 1 + (law[k - 1] - law[0] / 2) / max(law[k - 1] - law[k], 1e-12), 1.0))


def _total(sums: Sequence[_Sums]) -> _Sums:
    whole = sums[0]
    for one in sums[1:]:
        whole = whole + one
    return whole


def _correlate(a: Floats, b: Floats) -> Floats:
    """Σ a(x) b(x + lag) for every lag, negative ones from the end."""
    shape = tuple(2 * n for n in a.shape)
    return np.fft.irfft2(np.conj(np.fft.rfft2(a, shape)) * np.fft.rfft2(b, shape), shape)
