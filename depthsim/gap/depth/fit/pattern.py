"""The bias that a camera has at the same pixels in every frame, learned from a recording.

What a pixel's disparity is off by, averaged over frames, holds the pattern and noise. What the averages of two parts
of the frames have in common is the pattern alone: its variance, and the lag at which its correlation is a half. These
two make it a Gaussian process, of which the averages are noisy values; the grid is its posterior mean (kriging), which
is shrunk to 0 where the averages say little.

As long as other causes are not known the pattern is a smooth one, and whatever a turned mount, a scale or an offset
explains as well is left to them. A second one keeps that, for the case that none of them is a cause: a pattern may be a
ramp. Beside known causes it is all that they leave, and as fine as one half of the frames says of the other.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse.linalg import LinearOperator, cg

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.rigid import Floats, Look
from depthsim.gap.depth.fit.residuals import Cells, Residuals, scene_residuals, sensor_residuals
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.sensor.effect import Effect
from depthsim.sensor.effects.fixed_pattern import FixedPattern, picture, spline
from depthsim.sensor.pipeline import camera_for

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
_SMOOTH, _FINE = (2, 768), (4, 3000)
"""Knots within the lag of half correlation, and at most in all: columns that differ and rows that do not want many
across and few down."""
_CELLS = 80_000
"""Of the picture, about, at which a fine pattern is looked at."""
_LESS_NOISE = 4.0 ** -np.arange(6)
"""Of the noise: with so much a fine pattern is learned."""
_MOST_STEPS, _ENOUGH = 500, 1e-4
"""Of conjugate gradients, and what they leave, relative."""
_PRIORS = np.array([0.1] * 6 + [2.0, 0.1])
"""How large a turn [rad], a shift [m], an offset [px] and a scale may be."""
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


def learn_pattern(evidence: Evidence) -> list[Pattern]:
    """The pattern of the frames for fitting, and then with all that a mount, a scale and an offset would explain.

    Nothing where there is no pattern beside these, or there are too few frames.
    """
    frames = [int(i) for block in evidence.train for i in evidence.blocks[block]]
    if len(frames) < _LEAST_FRAMES:
        return []
    cells, seen = _seen(evidence.run, evidence.caster, frames)
    found = _Learner(cells, seen).learned()
    if found.is_none:
        return []
    whole = _Learner(cells, [(residual, known[:, :0], place) for residual, known, place in seen]).learned()
    return [found] if whole.is_none else [found, whole]


def learn(run: Run, caster: Caster, frames: Iterable[int] | None = None) -> Pattern:
    """The pattern of ``frames`` (all of them by default; some of many), against the scene.

    The poses should be registered first: a pattern is what they leave alike in all frames.
    """
    return _Learner(*_seen(run, caster, frames)).learned()


def _seen(run: Run, caster: Caster, frames: Iterable[int] | None) -> tuple[Cells, list[Residuals]]:
    """What some of the frames are off by from the scene, and the cells that this is counted in."""
    every = sorted(set(range(len(run)) if frames is None else frames))
    some = [every[k] for k in np.unique(np.linspace(0, len(every) - 1, _MOST_FRAMES).round().astype(int))]
    look = Look.at(run, caster, _SAMPLES)
    for index in some:
        look.load(index)
    look.cut_disparities(some)
    cells = Cells(run.camera, look.stride, look.camera.shape, look.stride // 2 - look.stride / 2)
    return cells, [scene_residuals(look, cells, index) for index in some]


def learn_beside(evidence: Evidence, others: Sequence[Effect], *, fine: bool) -> Pattern | None:
    """The pattern of the frames for fitting beside ``others``, the effects that are known. fine: whether as fine as
    they show it, or a smooth one."""
    if evidence.rows < evidence.camera.height:  # elsewhere nothing would be known of it
        return None
    camera = evidence.camera
    for effect in others:
        if effect.moves_camera and not camera.aligned:
            camera = effect.stored(camera_for(camera, [effect]))
    looked_at = _CELLS if fine else _SAMPLES
    cells = Cells(camera, max(1, round(np.sqrt(camera.left.width * camera.left.height / looked_at))))
    seen = [one for block in evidence.train for one in sensor_residuals(evidence, others, cells, block)]
    if len(seen) < _LEAST_FRAMES:
        return None
    found = _Learner(cells, seen, evidence.config.fit.calibrated if fine else None).learned()
    return None if found.is_none else found


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


@dataclass(frozen=True)
class _Law:
    """found: root mean square of the pattern [px]; size: the lags at which its correlation is a half, down and across
    [samples]; noise: [px²] its variance per frame, times the pixels over which it is correlated.
    """

    found: float
    size: Floats
    noise: float


class _Learner:
    """large: [px] up to this a bias is a fine pattern's, however rare it is; None for a smooth pattern."""

    def __init__(self, cells: Cells, seen: Sequence[Residuals], large: float | None = None) -> None:
        self.cells, self.shape, self.seen, self.large = cells, cells.shape, seen, large or 0.0
        self.fine = large is not None
        self.beta: Floats
        self.center: Floats
        self.priors = _PRIORS[: seen[0][1].shape[1]] if seen else _PRIORS
        self.chunks = np.array_split(np.arange(len(seen)), min(_CHUNKS, len(seen)))
        part = (3 * len(self.chunks) + 4) // 8
        self.ends = slice(0, part), slice(len(self.chunks) - part, None)

    def learned(self) -> Pattern:
        pattern = np.zeros(self.shape)
        self.beta = np.zeros(len(self.priors))
        for _ in range(_ROUNDS if len(self.priors) else 1):
            self._fit_static(pattern.reshape(-1))
            sums = [self._sum(chunk) for chunk in self.chunks]
            law = self._law_of(sums)
            grid = self._krige(_total(sums), law)
            pattern = picture(grid, self.shape)
        laws = [replace(law, noise=law.noise * part) for part in (_LESS_NOISE if self.fine else [1])]
        # Noise that goes together is reckoned with as if it did at all lags, which hides what is finer than it.
        (removed, error), law = max(((self._removed(sums, one), one) for one in laws), key=lambda found: found[0][0])
        if self.fine:
            grid = self._krige(_total(sums), law)
        return Pattern(
            grid=grid,
            amplitude=float(np.sqrt((picture(grid, self.cells.left.shape) ** 2).mean())),
            found=law.found,
            size=float(np.sqrt(law.size.prod())) * self.cells.stride,
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
            self.center[known] = np.where(off <= max(_FAR * np.median(off), self.large), center, np.nan)
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

    def _law_of(self, sums: Sequence[_Sums]) -> _Law:
        """The law of what both halves have in common, beside the noise that they do not."""
        none = _Law(0.0, np.ones(2), _LEAST_NOISE**2)
        a, b = (_total(sums[end]) for end in self.ends)
        both = (a.weight > 0) & (b.weight > 0)
        if np.count_nonzero(both) < 50:
            return none
        first, second = (np.where(both, s.error / np.where(both, s.weight, 1), 0) for s in (a, b))
        weight = np.where(both, np.minimum(a.weight, b.weight), 0)
        products, weights = _correlate(weight * first, weight * second), _correlate(weight, weight)
        if products[0, 0] <= 0:
            return none
        sizes = [
            _half(line(products)[: n // 2] / np.maximum(line(weights)[: n // 2], 1e-12))
            for line, n in zip((lambda x: x[:, 0], lambda x: x[0]), self.shape, strict=True)
        ]
        return _Law(float(np.sqrt(products[0, 0] / weights[0, 0])), np.array(sizes), self._noise_of(sums))

    def _krige(self, whole: _Sums, law: _Law) -> Floats:
        """(rows, columns) the posterior mean at the knots, some within the lag of half correlation."""
        seen = [np.flatnonzero((whole.weight > 0).sum(axis=axis)) for axis in (1, 0)]
        pixels = np.array(
            [np.ptp(places) + 1 if places.size else n for places, n in zip(seen, self.shape, strict=True)]
        )
        within, most = _FINE if self.fine else _SMOOTH
        wanted = np.minimum(within * pixels / law.size + 1, pixels)
        if wanted.prod() > most:  # fewer in the direction that has more, and in both where that is not enough
            less = max(most / wanted.prod(), wanted.min() / wanted.max())
            wanted[wanted.argmax()] *= less
            wanted *= min(np.sqrt(most / wanted.prod()), 1)
        grid = np.zeros([max(int(one), 3) for one in wanted * self.shape / pixels])
        if law.found == 0 or not all(places.size for places in seen):
            return grid
        # What is beyond the pixels that are seen, of which an aligned camera's left imager has many, is 0.
        box = tuple(slice(places[0], places[-1] + 1) for places in seen)
        near, roots, splines = [], [], []
        for k, n, places, size in zip(grid.shape, self.shape, seen, law.size, strict=True):
            step = (n - 1) / (k - 1)
            at = np.arange(k) * step
            some = np.flatnonzero((at > places[0] - 2 * step) & (at < places[-1] + 2 * step))
            # What may be of any fineness has parts of all, as a correlation with a cusp has.
            prior = 2.0 ** -((np.abs(np.subtract.outer(at[some], at[some])) / size) ** (1 if self.fine else 2))
            values, vectors = np.linalg.eigh(prior)
            near.append(some)
            roots.append(vectors * np.sqrt(np.maximum(values, 0)))
            splines.append(spline(k, n)[places[0] : places[-1] + 1, some] @ roots[-1])
        down, across = splines
        weight, right = law.found**2 * whole.weight[box], law.found * down.T @ whole.error[box] @ across

        def times(x: Floats) -> Floats:
            x = x.reshape(right.shape)
            return np.ravel(down.T @ (weight * (down @ x @ across.T)) @ across + law.noise * x)

        # In units of the prior's root, without the inverse of a matrix that is nearly singular.
        matrix = LinearOperator((right.size, right.size), matvec=times, dtype=np.float64)
        solved = cg(matrix, right.ravel(), rtol=_ENOUGH, atol=0.0, maxiter=_MOST_STEPS)[0].reshape(right.shape)
        grid[np.ix_(*near)] = law.found * roots[0] @ solved @ roots[1].T
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

    def _removed(self, sums: Sequence[_Sums], law: _Law) -> tuple[float, float]:
        """The chunks of each end judged by the grid of the other end's."""
        gains, wholes = [], []
        for own, other in (self.ends, self.ends[::-1]):
            pattern = picture(self._krige(_total(sums[other]), law), self.shape)
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
