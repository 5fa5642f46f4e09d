"""Rigid motions of frames beside what is alike in all of them: a mixed linear model.

The motions are random with a variance for each direction, which is estimated too, so a direction that the scene does
not show, or that varies by no more than chance, is left at zero (shrunk to it, as best linear unbiased prediction
does).

The variances are free of the noise: they are the covariance of what two halves of the pixels say, and noise is not in
common to both. The halves are tiles with margins between them, because noise of neighbouring pixels is.
"""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import nnls

from depthsim.gap.depth.data.equations import Equations, together
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.data.rigid import Floats

_FIRST = np.array([0.01] * 3 + [0.01] * 3)
"""Standard deviations that are begun with [rad] and [m]."""
FINE = np.array([np.radians(0.1)] * 3 + [0.001] * 3)
"""Standard deviations that the scene must be able to show [rad] and [m]."""
_SURE = 3.0
"""A variance that is not above this many of its standard errors is none."""
_SEEN = 10.0
"""Where chance is more than this many of ``FINE`` the scene does not show a direction."""
_LEAST_FRAMES = 6
"""Of fewer frames nobody knows what is alike in all of them."""
_MEDIAN_SQUARE = 0.455
"""The median of the square of a standard normal number."""
_LAGS = 10
"""Frames so far apart or farther have noise of their own."""


class MixedModel:
    """Motions of the frames, random with a variance for each direction, and nuisances that are alike in all.

    halves: the equations of each frame, of one half of its pixels, of the other, and of what is in neither. frames,
    stamps: which they are, and when they were taken [s]. priors: (nuisances,) how large each may be; in_time: which of
    them change with time or motion. beta: (nuisances,) as they are found; random: (frames, 6) the motions, of variance
    ``variance``. inflation: how much noisier the pixels are than they were weighted for.
    """

    halves: list[list[Equations]]

    def __init__(self, frames: Sequence[int], stamps: Floats, priors: Floats, in_time: Sequence[int]) -> None:
        self.frames, self.stamps, self.priors, self.in_time = list(frames), stamps, priors, list(in_time)
        self.count = len(priors)
        self.beta = np.zeros(self.count)
        self.random = np.zeros((len(self.frames), 6))
        self.broad = _FIRST**2
        self.inflation = 1.0

    def _lasting(self) -> float:
        """Frames in which a random error is as good as the same."""
        law = np.exp(-np.abs(np.subtract.outer(self.stamps, self.stamps)) / max(self._time(), 1e-6))
        return float(law.sum() / len(law))

    def _time(self) -> float:
        return float(np.nan_to_num(self._correlation_time())) if self.variance.any() else 0.0

    def _solve(self) -> None:
        """Nuisances, variances and motions of the frames."""
        for _ in range(5):
            self.beta = self._nuisances()
            self.found, self.chance = self._variances()
            self.broad = np.maximum(self.found, FINE**2)
        self.beta = self._nuisances()
        pooled, chance = (np.repeat(part, 3) for part in _pooled(self.found, self.chance))
        sure = (self.found > _SURE * self.chance) | (pooled > _SURE * chance)
        self.variance = np.where(sure & (len(self.frames) >= _LEAST_FRAMES), self.found, 0.0)
        self.random = np.array([self._predicted(halves)[0] for halves in self.halves])

    def _nuisances(self) -> Floats:
        """(nuisances,) by generalised least squares: the motions are random."""
        matrix, right = np.diag(self.priors**-2.0), np.zeros(self.count)
        root = np.sqrt(self.broad)
        for halves in self.halves:
            jj, jn, nn, j, n = together(halves)
            inner = np.linalg.inv(self.inflation * np.eye(6) + root[:, None] * jj * root)
            gain = jn.T @ (root[:, None] * inner * root)
            matrix += (nn - gain @ jn) / self.inflation
            right += (n - gain @ j) / self.inflation
        self.beta_covariance = np.linalg.inv(matrix)
        self.beta_error = np.sqrt(np.diag(self.beta_covariance))
        return np.asarray(np.linalg.solve(matrix, right))

    def _variances(self) -> tuple[Floats, Floats]:
        """(6,) variances of the motions, and the standard error that chance gives them.

        Of each half a ridge estimate is made, whose mean is resolution · motion; the covariance of the two estimates
        is resolution · variance · resolution', without noise.
        """
        said, resolution, expected = self._halves_say()
        self.inflation *= self._grown(said[0] - said[1], expected.sum(axis=0), resolution)
        # Over frames and directions i: a_i b_i = Σ_j R_ij R'_ij v_j, solved for v >= 0 by weighted least squares.
        design = resolution[0] * resolution[1]
        size = np.sqrt(expected.prod(axis=0))
        weight = 1 / (size + np.einsum("fij,j->fi", design, self.broad))
        rows = (weight[:, :, None] * design * self.broad).reshape(-1, 6)
        found = nnls(rows, (weight * said[0] * said[1]).reshape(-1))[0] * self.broad
        # What no frame resolves gets a huge error here, and counts as not shown.
        inverse = np.linalg.inv(rows.T @ rows + 1e-14 * np.eye(6))
        dark = np.diag(rows.T @ rows) < 1e-12
        solved = (inverse @ rows.T).reshape(6, *said.shape[1:]) * weight * self.broad[:, None, None]
        alike = self._alike((said[0] - said[1]) / np.sqrt(expected.sum(axis=0)))
        chance = [np.einsum("fi,gi,fg->", part * size, part * size, alike**2) for part in solved]
        frames = max(len(self.frames), 2)
        error = np.where(dark, np.inf, np.sqrt(np.maximum(chance, 1e-40)))
        return np.where(np.sqrt(error) < _SEEN * FINE, found * frames / (frames - 1), 0.0), error

    def _halves_say(self) -> tuple[Floats, Floats, Floats]:
        """What each half says of the motions (2, frames, 6), what part of them (2, frames, 6, 6), and its variance."""
        prior = np.diag(1 / self.broad)
        said, resolution, expected = [], [], []
        for h in (0, 1):
            left = np.array([halves[h].left(self.beta) for halves in self.halves]) / self.inflation
            information = np.array([halves[h].jj for halves in self.halves]) / self.inflation
            inverse = np.linalg.inv(information + prior)
            said.append(np.einsum("fij,fj->fi", inverse, left))
            resolution.append(inverse @ information)
            expected.append(np.maximum(np.einsum("fii->fi", inverse @ information @ inverse), 1e-30))
        return np.array(said), np.array(resolution), np.array(expected)

    def _alike(self, noise: Floats) -> Floats:
        """(frames, frames) how the noise of two frames is correlated: by how many frames they are apart."""
        count = len(noise)
        apart = np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
        clipped = np.clip(noise, -3, 3)
        power = max(float((clipped**2).mean()), 1e-30)
        law = np.zeros(count)
        for k in range(min(count, _LAGS)):
            law[k] = (clipped[k:] * clipped[: count - k]).mean() / power
        return law[apart]

    def _grown(self, difference: Floats, expected: Floats, resolution: Floats) -> float:
        """How much larger the variance of the halves' difference is than was expected."""
        shown = np.einsum("hfii->hfi", resolution).min(axis=0) > 0.5
        if np.count_nonzero(shown) < 20:
            return 1.0
        ratio = float(np.median(difference[shown] ** 2 / expected[shown])) / _MEDIAN_SQUARE
        return max(ratio, 1 / self.inflation)

    def _predicted(self, halves: Sequence[Equations]) -> tuple[Floats, Floats]:
        """The motion of one frame, shrunk by its uncertainty, and the covariance of its error."""
        root = np.sqrt(self.variance)
        jj, jn, _, j, _ = together(halves)
        left = j - jn @ self.beta
        inner = np.linalg.inv(self.inflation * np.eye(6) + root[:, None] * jj * root)
        gain = root[:, None] * inner * root
        return gain @ left, gain * self.inflation

    def _helps(self) -> bool:
        """Whether the motions lower the residuals by themselves, and not only as the counterpart of a nuisance.

        A drift and a motion that undo each other leave the poses where they were.
        """
        static = np.ones(self.count, np.bool_)
        static[self.in_time] = False
        squares = []
        for motions in (np.zeros_like(self.random), self.random):
            matrix, right, size = np.diag(self.priors[static] ** -2.0), np.zeros(np.count_nonzero(static)), 0.0
            for halves, motion in zip(self.halves, motions, strict=True):
                jj, jn, nn, j, n = together(halves)
                matrix = matrix + nn[np.ix_(static, static)]
                right = right + (n - motion @ jn)[static]
                size += float(motion @ jj @ motion - 2 * motion @ j)
            squares.append(size - float(right @ np.linalg.solve(matrix, right)))
        return squares[1] < squares[0]

    def _posterior(self) -> Floats:
        return np.array([self._predicted(halves)[1] for halves in self.halves])

    def _errors(self, alike: tuple[Floats, Floats]) -> PoseErrors:
        """alike: what the nuisances say that all poses are off by, and the standard errors."""
        shown = (np.sqrt(self.chance) < _SEEN * FINE) & (len(self.frames) >= _LEAST_FRAMES)
        time = self._correlation_time() if self.variance.any() else np.nan
        law = np.exp(-np.abs(np.subtract.outer(self.stamps, self.stamps)) / max(np.nan_to_num(time), 1e-6))
        drawn = np.sqrt(2 * (law**2).sum()) / len(self.stamps)  # relative error of a variance from a draw that short
        of_variance = np.hypot(self.chance, drawn * self.variance)
        known = self.variance > 0
        error = np.where(known, of_variance / (2 * np.sqrt(np.where(known, self.variance, 1))), np.sqrt(self.chance))
        pooled = np.sqrt(_pooled(self.variance, self.chance)[0])
        trust = np.maximum(self.chance.reshape(2, 3) ** -2.0, 1e-30)
        of_pooled = np.sqrt((trust**2 * of_variance.reshape(2, 3) ** 2).sum(axis=1)) / trust.sum(axis=1)
        # Of what is found to be 0: the root of the variance's error.
        pooled_error = np.where(pooled > 0, of_pooled / (2 * np.maximum(pooled, 1e-12)), np.sqrt(of_pooled))
        step = self._step()
        return PoseErrors(
            deviation=np.where(shown, np.sqrt(self.variance), np.nan),
            error=np.where(shown, error, np.nan),
            pooled=(float(pooled[0]), float(pooled[1])),
            pooled_error=(float(pooled_error[0]), float(pooled_error[1])),
            correlation_time=time,
            correlation=self._correlation(time, step),
            step=step,
            constant=alike[0][:6],
            constant_error=alike[1][:6],
            late=float(alike[0][6]),
            late_error=float(alike[1][6]),
            removed=self._removed() if self.variance.any() else 0.0,
            independent=float(len(self.stamps) / law.sum(axis=1).mean()),
        )

    def _correlation_time(self) -> float:
        """[s] by least squares of exp(-lag / time) on the covariances of the halves of different frames."""
        said, resolution, _ = self._halves_say()
        resolved = np.einsum("hfii->hfi", resolution)
        varies = self.variance > 0
        lags = np.abs(self.stamps[:, None] - self.stamps)
        shares = []
        for i in np.flatnonzero(varies):
            weight = np.outer(resolved[0, :, i], resolved[1, :, i])
            found = np.outer(said[0, :, i], said[1, :, i]) / self.variance[i]
            trust = self.variance[i] / (self.variance[i] + self.chance[i])
            shares.append((trust * found * weight, trust * weight**2))
        product, weight = sum(p for p, _ in shares), sum(w for _, w in shares)
        apart = lags > 0
        step = self._step()
        times = np.concatenate([[1e-3 * step], np.geomspace(0.2 * step, max(lags.max(), step), 60)])
        # Each time scale is judged on the lags up to a few of the longest that still matter.
        near = apart & (lags < 0.35 * max(lags.max(), step))
        law = [np.exp(-lags[near] / time) for time in times]
        loss = [float((weight[near] * x * x).sum() - 2 * (product[near] * x).sum()) for x in law]
        best = float(times[int(np.argmin(loss))])
        return 0.0 if best < 0.25 * step else best

    def _step(self) -> float:
        """[s] the time from a frame to the next."""
        return float(np.min(np.diff(np.unique(self.stamps)))) if len(self.stamps) > 1 else 1.0

    def _correlation(self, time: float, step: float) -> tuple[float, float]:
        """Between one frame and the next, and the standard error of its Fisher z: by how many pairs there are.

        Lags of more than one frame say something, too, where the correlation lasts: as much as the pairs within it.
        """
        apart = np.diff(self.stamps)
        pairs = int(np.count_nonzero(apart < max(1.5 * step, np.nan_to_num(time))))
        count = pairs * int(np.count_nonzero(self.variance))
        law = float(np.exp(-step / time)) if np.nan_to_num(time) > 0 else 0.0
        return law, float(1 / np.sqrt(max(count - 3, 1)))

    def _removed(self) -> float:
        """Of what each half holds of the motions' effect on it, the share that the other half's motions remove."""
        whole = 0.0
        for halves in self.halves:
            for e in halves[:2]:
                left = e.left(self.beta)
                whole += float(left @ np.linalg.solve(e.jj + 1e-9 * np.trace(e.jj) * np.eye(6) + 1e-12, left))
        return self._gained() / whole if whole > 0 else 0.0

    def _gained(self) -> float:
        """How much less squares are left on each half with the motions that the other half says."""
        said = self._halves_say()[0]
        return sum(
            _crossed([e.jj for e in halves[:2]], [e.left(self.beta) for e in halves[:2]], said[:, k])
            for k, halves in enumerate(self.halves)
        )

    def _gained_by(self, shapes: Floats) -> float:
        """The same with errors of the sensor in place of motions: (nuisances, shapes) by which each frame differs."""
        gained = 0.0
        for halves in self.halves:
            inner = [shapes.T @ e.nn @ shapes for e in halves[:2]]
            left = [shapes.T @ (e.n - e.nn @ self.beta) for e in halves[:2]]
            said = [np.linalg.pinv(a, hermitian=True) @ b for a, b in zip(inner, left, strict=True)]
            gained += _crossed(inner, left, said)
        return gained


def _crossed(inner: Sequence[Floats], left: Sequence[Floats], said: Sequence[Floats] | Floats) -> float:
    """How much less squares are left on both halves of a frame, of normal equations inner · x = left, with the x that
    is said by the other one."""
    halves = zip(inner, left, (said[1], said[0]), strict=True)
    return sum(float(2 * x @ right - x @ matrix @ x) for matrix, right, x in halves)


def _pooled(variance: Floats, error: Floats) -> tuple[Floats, Floats]:
    """(2,) of turns and of shifts together: the mean of three variances by their errors, and its error."""
    weight = np.maximum(error.reshape(2, 3) ** -2.0, 1e-30)
    return (weight * variance.reshape(2, 3)).sum(axis=1) / weight.sum(axis=1), weight.sum(axis=1) ** -0.5
