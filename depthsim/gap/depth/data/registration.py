"""How far the poses of a recording are off from frame to frame, and the poses without that.

A frame's residuals are explained by three parts together: what the sensor does alike in all frames (a bias by pixel
and by disparity, a lens, a scale that drifts, a mount that is turned, stamps that are late, rows one after another:
the nuisances of :mod:`~depthsim.gap.depth.data.rigid`), a rigid motion of the frame's own, and noise. The first is
left in the recording; only the second is an error of its poses. It is a mixed linear model: the rigid motions are
random with a variance for each direction, which is estimated too, so a direction that the scene does not show, or that
varies by no more than chance, is left at zero (shrunk to it, as best linear unbiased prediction does).

The variances are free of the noise: they are the covariance of what two halves of the pixels say, and noise is not in
common to both. The halves are tiles with margins between them, because noise of neighbouring pixels is.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from depthsim.gap.depth.data.rigid import Floats, Look
from depthsim.kernels import kernel
from depthsim.parallel import core_count
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.sensor.effects.pose_noise import PoseNoise
from depthsim.sensor.motion import Motion
from depthsim.trajectory import Trajectory
from depthsim.trajectory.rotation import multiply, turned

ROUNDS = 3
"""How often the scene is cast anew from where the camera is by now."""
_FIRST = np.array([0.01] * 3 + [0.01] * 3)
"""Standard deviations that are begun with [rad] and [m]."""
_FINE = np.array([np.radians(0.1)] * 3 + [0.001] * 3)
"""Standard deviations that the scene must be able to show [rad] and [m]."""
_SAMPLES = 40_000
"""Pixels of a frame that its motion is at last determined by, about."""
_LEAST_PIXELS = 200
"""A frame with fewer says nothing."""
_SURE = 3.0
"""A variance that is not above this many of its standard errors is none."""
_SEEN = 10.0
"""Where chance is more than this many of ``_FINE`` the scene does not show a direction."""
_LEAST_FRAMES = 6
"""Of fewer frames nobody knows what is alike in all of them."""
_THREE, _ONE = 16.3, 3.3
"""What is alike in all frames is a mount's or late stamps' above this chi square of three or this many standard errors
(1 in 1000): below it is what random errors leave on average."""
_NOTHING = 1e-9
"""The prior of what is held at 0."""
_TUKEY = 4.685
_MEDIAN_SQUARE = 0.455
"""The median of the square of a standard normal number."""
_LAGS = 10
"""Frames so far apart or farther have noise of their own."""
_LEAST_NOISE = 0.01
"""[px] The noise is never taken for less."""


@dataclass(frozen=True)
class PoseErrors:
    """What is random in the poses, and what is constant; six numbers are about and along the camera's x, y, z.

    deviation: (6,) standard deviation, turn [rad] and shift [m]; NaN where the scene does not show it.
    error: (6,) standard error of ``deviation`` (of the square root of the variance's error, where that is 0).
    correlation_time: [s]; 0 where frames next to each other are independent; NaN where nothing is random.
    pooled: the standard deviation of a turn [rad] and of a shift [m], those about or along all axes together.
    pooled_error: their standard errors. correlation: between one frame and the next, and its standard error; step: the
    time between them [s].
    constant: (6,) what is alike in all frames, and is left in: a turned or shifted mount. late: [s] what the poses
    say is so much after the stamps; left in, too. Where they are no more than random errors leave on average they are
    taken for that, and removed. constant_error, late_error: their standard errors, large where the
    recording does not tell them apart from each other or from the camera's own errors. removed: of what rigid motions
    explain on one half of the pixels, the share that those found on the other half remove.
    """

    deviation: Floats
    error: Floats
    pooled: tuple[float, float]
    pooled_error: tuple[float, float]
    correlation_time: float
    correlation: tuple[float, float]
    step: float
    constant: Floats
    constant_error: Floats
    late: float
    late_error: float
    removed: float

    @property
    def is_none(self) -> bool:
        """Whether no direction varies by more than chance."""
        return not np.nansum(self.deviation) > 0

    @property
    def is_unknown(self) -> bool:
        """Whether there are too few frames, or the scene shows no direction."""
        return bool(np.isnan(self.deviation).all())

    @property
    def turn(self) -> tuple[float, float, float] | None:
        """[deg] of the mount, about x, y and z; None where it may be by chance."""
        turn, error = self.constant[:3], self.constant_error[:3]
        x, y, z = np.degrees(turn)
        return (float(x), float(y), float(z)) if (np.abs(turn) > _ONE * error).any() else None

    @property
    def rotation(self) -> float:
        """Standard deviation of a turn about an axis that the scene shows [deg]."""
        return float(np.degrees(self.pooled[0]))

    @property
    def translation(self) -> float:
        """Standard deviation of a shift along an axis that the scene shows [m]."""
        return self.pooled[1]

    def effect(self) -> PoseNoise:
        """The effect that puts a simulated camera where this one was, by the law of its errors."""
        time = float(f"{np.nan_to_num(self.correlation_time):.4g}")
        turn, shift = (float(f"{value:.4g}") for value in (self.rotation, self.translation))
        return PoseNoise(rotation=min(turn, 20.0), translation=min(shift, 0.5), correlation_time=time)

    def intervals(self, errors: float = 1.96) -> dict[str, tuple[float, float]]:
        """Of each parameter of :meth:`effect`, so many standard ``errors`` to either side.

        The correlation time's is that of the correlation with the next frame, as normal as Fisher's z has it.
        """
        found = {}
        for name, value, error, highest in zip(
            ("rotation", "translation"), (self.rotation, self.translation),
            (np.degrees(self.pooled_error[0]), self.pooled_error[1]), (20.0, 0.5), strict=True,
        ):  # fmt: skip
            found[name] = (max(float(value - errors * error), 0.0), min(float(value + errors * error), highest))
        if not self.is_none:
            middle, half = np.arctanh(min(self.correlation[0], 0.999)), errors * self.correlation[1]
            low, high = (np.clip(np.tanh(middle + sign * half), 0, 1 - 1e-9) for sign in (-1, 1))
            times = [float(-self.step / np.log(law)) if law > 0 else 0.0 for law in (low, high)]
            found["correlation_time"] = (min(times[0], 1e4), min(times[1], 1e4))
        return found

    @property
    def text(self) -> str:
        """As it is told: ``poses off by 3.1 mm and 0.40 deg per frame, correlated over 0.5 s``."""
        if self.is_none:
            return "the poses are not off by more than chance from frame to frame"
        time = f", correlated over {self.correlation_time:.2g} s" if self.correlation_time > 0 else ""
        return f"poses off by {1e3 * self.translation:.2g} mm and {self.rotation:.2g} deg per frame{time}"


@dataclass(frozen=True)
class Registration:
    """The rigid corrections of some frames. corrections: (frames, 6) random part, turn [rad] and shift [m] in the
    camera's axes: the true pose is the recorded one · exp(correction). covariance: (frames, 6, 6) of their errors.
    """

    frames: NDArray[np.int64]
    stamps: Floats
    corrections: Floats
    covariance: Floats
    errors: PoseErrors

    def applied(self, run: Run) -> Run:
        """The run with its poses corrected; between frames that were looked at corrections are interpolated."""
        if self.errors.is_none:
            return run
        trajectory, truth = (_corrected(p, self.stamps, self.corrections) for p in (run.trajectory, run.truth))
        return replace(run, trajectory=trajectory, truth=truth)


def _corrected(path: Trajectory, stamps: Floats, corrections: Floats) -> Trajectory:
    six = np.stack([np.interp(path.stamps, stamps, part) for part in corrections.T], axis=1)
    half = np.linalg.norm(six[:, :3], axis=1, keepdims=True) / 2
    turns = np.hstack([six[:, :3] * np.sinc(half / np.pi) / 2, np.cos(half)])
    moved = np.einsum("nij,nj->ni", path.matrices()[:, :3, :3], six[:, 3:])
    return replace(path, positions=path.positions + moved, quaternions=multiply(path.quaternions, turns))


def register(run: Run, caster: Caster, frames: Iterable[int] | None = None, threads: int | None = None) -> Registration:
    """What the poses of ``frames`` (all of them by default) are off by against the scene.

    Holes, moving things and edges are borne; the scene and the constant part of the poses must be right to a few
    degrees and centimetres.
    """
    return _Work(run, caster, sorted(set(range(len(run)) if frames is None else frames)), threads).done()


@dataclass
class _Equations:
    """Normal equations of some pixels. jj, jn, nn: information of rigid motion and nuisances; j, n: right sides."""

    jj: Floats
    jn: Floats
    nn: Floats
    j: Floats
    n: Floats

    def left(self, beta: Floats) -> Floats:
        """(6,) the right side without the nuisances."""
        return self.j - self.jn @ beta


class _Work:
    """The alternation of casting and solving."""

    def __init__(self, run: Run, caster: Caster, frames: Sequence[int], threads: int | None) -> None:
        self.run, self.frames = run, list(frames)
        self.threads = threads or core_count()
        self.look = Look.at(run, caster)
        self._each(self.look.load)
        self.look.cut_disparities(self.frames[:: max(1, len(self.frames) // 20)])
        self.paths = run.trajectory, run.truth
        self.motion = Motion.along(*self.paths)
        self.stamps = np.array([float(run.stamps[i]) for i in self.frames])
        self.priors = self.look.priors
        self.count = len(self.priors)
        self.beta = np.zeros(self.count)
        self.random = np.zeros((len(self.frames), 6))
        self.broad = _FIRST**2
        self.noise = np.full((2, 1), np.nan)
        self.inflation = 1.0

    def _each(self, work: Callable[[int], object]) -> list:
        with ThreadPoolExecutor(self.threads) as pool:
            return list(pool.map(work, self.frames))

    def done(self) -> Registration:
        """The corrections, after ``ROUNDS`` rounds."""
        for _ in range(ROUNDS):
            self._cast()
            self._solve()
        if not self._helps():
            self.variance, self.random = np.zeros(6), np.zeros_like(self.random)
        self.alike = self.beta[:7].copy(), self.beta_error[:7].copy()
        if self.variance.any():
            self._tell_apart()
            if self.variance.any():
                self._refine()
        covariance = self._posterior()
        errors = self._errors()
        return Registration(np.array(self.frames, np.int64), self.stamps, self.random, covariance, errors)

    def _tell_apart(self) -> None:
        """Take for random what is alike in all frames, where it is no more than random errors leave on average."""
        free = self.priors
        # Errors that last are fewer than the frames.
        lasting = self._lasting()
        held = np.zeros(self.count, np.bool_)
        for part in (slice(0, 3), slice(3, 6)):
            mount, covariance = self.beta[part], lasting * self.beta_covariance[part, part]
            held[part] = mount @ np.linalg.solve(covariance, mount) < _THREE
        # Of poses that jitter, those of a moment between two frames are their mean, and fit better than either. So late
        # stamps are tried against the motion of the registered camera.
        held[6] = True
        self._again(np.where(held, _NOTHING, free))
        registered = Motion.along(*(_corrected(path, self.stamps, self.random) for path in self.paths))
        twist = np.array([_twist(registered, stamp) for stamp in self.stamps])
        trust = twist / np.maximum(self.variance, _FINE**2)
        information = max(float((trust * twist).sum()), 1e-12)
        late = float((trust * self.random).sum()) / information
        if late**2 > _ONE**2 * self._lasting() / information:
            held[6] = False
            self._again(np.where(held, _NOTHING, free))

    def _again(self, priors: Floats) -> None:
        self.priors = priors
        for _ in range(2):
            self._cast()
            self._solve()

    def _refine(self) -> None:
        """The motions from more of the pixels, with the nuisances as they were found."""
        knots = self.look.knots
        self.look = Look.at(self.run, self.look.caster, _SAMPLES)
        self.look.knots = knots
        self._each(self.look.load)
        self._cast(solved=True)
        # Finer samples have more of their noise in common.
        said, resolution, expected = self._halves_say()
        self.inflation *= self._grown(said[0] - said[1], expected.sum(axis=0), resolution)
        self.random = np.array([self._predicted(halves)[0] for halves in self.halves])

    def _lasting(self) -> float:
        """Frames in which a random error is as good as the same."""
        law = np.exp(-np.abs(np.subtract.outer(self.stamps, self.stamps)) / max(self._time(), 1e-6))
        return float(law.sum() / len(law))

    def _time(self) -> float:
        return float(np.nan_to_num(self._correlation_time())) if self.variance.any() else 0.0

    def _cast(self, solved: bool = False) -> None:
        """The normal equations of every frame's halves, from where it is by now. solved: the nuisances are known."""
        none = np.zeros((6, self.count)), np.zeros((self.count,) * 2), np.zeros(self.count)
        place = {index: k for k, index in enumerate(self.frames)}

        def one(index: int) -> tuple[list[_Equations], Floats, Floats]:
            # Where the frame was taken, as far as is known by now.
            stamp = float(self.run.stamps[index]) + self.beta[6]
            off, twist = self.beta[:6] + self.random[place[index]], _twist(self.motion, stamp)
            pose = self.motion.at(stamp)[0]
            pose[:3, 3] += pose[:3, :3] @ off[3:]
            pose[:3, :3] = pose[:3, :3] @ turned(off[:3])
            seen = self.look.frame(index, pose, twist)
            other = seen.residual - seen.nuisance[:, 7:] @ self.beta[7:]
            noise = self._noise_at(seen.disparity, other)
            inside = np.abs(other) < _TUKEY * noise
            weight = np.where(inside, (1 - (other / (_TUKEY * noise)) ** 2) ** 2, 0) / noise**2
            target = seen.residual + seen.rigid @ (off + self.beta[6] * twist)
            halves = []
            for which in (0, 1, 2):
                own = (seen.half == which) & inside
                if solved:
                    left = target[own] - seen.nuisance[own] @ self.beta
                    known = _equations(seen.rigid[own], seen.nuisance[own, :0], left, weight[own])
                    halves.append(_Equations(known.jj, none[0], none[1], known.j, none[2]))
                    continue
                halves.append(_equations(seen.rigid[own], seen.nuisance[own], target[own], weight[own]))
            if np.count_nonzero(inside) < _LEAST_PIXELS:
                halves = [_equations(seen.rigid[:0], seen.nuisance[:0], target[:0], weight[:0])] * 3
            some = slice(None, None, 7)
            return halves, seen.disparity[inside][some], other[inside][some]

        found = self._each(one)
        self.halves = [halves for halves, _, _ in found]
        self._measure_noise(np.concatenate([d for _, d, _ in found]), np.concatenate([r for _, _, r in found]))

    def _noise_at(self, disparity: Floats, residual: Floats) -> Floats:
        """[px] as measured at the last cast; at the first by the frame itself."""
        if np.isnan(self.noise).any():
            spread = 1.4826 * np.median(np.abs(residual)) if residual.size else 1.0
            return np.full(len(disparity), max(float(spread), _LEAST_NOISE))
        return np.interp(disparity, *self.noise)

    def _measure_noise(self, disparity: Floats, residual: Floats) -> None:
        """The residuals' size by disparity. What the nuisances and motions of this round explain is still in it."""
        if disparity.size < 100:
            return
        cuts = np.unique(np.quantile(disparity, np.linspace(0, 1, 9)))
        cell = np.clip(np.searchsorted(cuts, disparity, side="right") - 1, 0, len(cuts) - 2)
        cells = [residual[cell == k] for k in range(len(cuts) - 1)]
        size = [1.4826 * float(np.median(np.abs(part))) if part.size else np.nan for part in cells]
        at, sizes = (cuts[1:] + cuts[:-1]) / 2, np.array(size)
        known = np.isfinite(sizes)
        if known.any():
            self.noise = np.stack([at[known], np.maximum(sizes[known], _LEAST_NOISE)])

    def _solve(self) -> None:
        """Nuisances, variances and motions of the frames."""
        for _ in range(5):
            self.beta = self._nuisances()
            self.found, self.chance = self._variances()
            self.broad = np.maximum(self.found, _FINE**2)
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
            jj, jn, nn, j, n = _sum(halves)
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
        return np.where(np.sqrt(error) < _SEEN * _FINE, found * frames / (frames - 1), 0.0), error

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

    def _predicted(self, halves: Sequence[_Equations]) -> tuple[Floats, Floats]:
        """The motion of one frame, shrunk by its uncertainty, and the covariance of its error."""
        root = np.sqrt(self.variance)
        jj, jn, _, j, _ = _sum(halves)
        left = j - jn @ self.beta
        inner = np.linalg.inv(self.inflation * np.eye(6) + root[:, None] * jj * root)
        gain = root[:, None] * inner * root
        return gain @ left, gain * self.inflation

    def _helps(self) -> bool:
        """Whether the motions lower the residuals by themselves, and not only as the counterpart of a nuisance.

        A drift and a motion that undo each other leave the poses where they were.
        """
        static = np.ones(self.count, np.bool_)
        static[self.look.in_time] = False
        squares = []
        for motions in (np.zeros_like(self.random), self.random):
            matrix, right, size = np.diag(self.priors[static] ** -2.0), np.zeros(np.count_nonzero(static)), 0.0
            for halves, motion in zip(self.halves, motions, strict=True):
                jj, jn, nn, j, n = _sum(halves)
                matrix = matrix + nn[np.ix_(static, static)]
                right = right + (n - motion @ jn)[static]
                size += float(motion @ jj @ motion - 2 * motion @ j)
            squares.append(size - float(right @ np.linalg.solve(matrix, right)))
        return squares[1] < squares[0]

    def _posterior(self) -> Floats:
        return np.array([self._predicted(halves)[1] for halves in self.halves])

    def _errors(self) -> PoseErrors:
        shown = (np.sqrt(self.chance) < _SEEN * _FINE) & (len(self.frames) >= _LEAST_FRAMES)
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
            constant=self.alike[0][:6],
            constant_error=self.alike[1][:6],
            late=float(self.alike[0][6]),
            late_error=float(self.alike[1][6]),
            removed=self._removed() if self.variance.any() else 0.0,
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
        said = self._halves_say()[0]
        gained = whole = 0.0
        for k, halves in enumerate(self.halves):
            for h in (0, 1):
                e, other = halves[h], said[1 - h, k]
                left = e.left(self.beta)
                gained += float(2 * other @ left - other @ e.jj @ other)
                whole += float(left @ np.linalg.solve(e.jj + 1e-9 * np.trace(e.jj) * np.eye(6) + 1e-12, left))
        return gained / whole if whole > 0 else 0.0


def _equations(rigid: Floats, nuisance: Floats, target: Floats, weight: Floats) -> _Equations:
    both = np.hstack([rigid, nuisance])
    whole, right = np.zeros((both.shape[1],) * 2), np.zeros(both.shape[1])
    _gather(both, weight, target, whole, right)
    return _Equations(whole[:6, :6], whole[:6, 6:], whole[6:, 6:], right[:6], right[6:])


@kernel
def _gather(columns, weight, target, whole, right):
    """whole += columns' · weight · columns, right += columns' · weight · target; BLAS's threads would be in the way."""
    count = columns.shape[1]
    for p in range(columns.shape[0]):
        row = columns[p]
        for i in range(count):
            heavy = weight[p] * row[i]
            right[i] += heavy * target[p]
            line = whole[i]
            for j in range(count):
                line[j] += heavy * row[j]


def _sum(parts: Sequence[_Equations]) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """jj, jn, nn, j, n of some parts together."""
    jj, jn, nn, j, n = (
        np.sum([getattr(part, name) for part in parts], axis=0) for name in ("jj", "jn", "nn", "j", "n")
    )
    return jj, jn, nn, j, n


def _twist(motion: Motion, stamp: float, step: float = 0.015) -> Floats:
    """(6,) the camera's velocity in its own axes [rad/s] and [m/s], over twice ``step`` [s]: recorded poses jitter."""
    first, middle, last = motion.at([stamp - step, stamp, stamp + step])
    turn = first[:3, :3].T @ last[:3, :3] / (4 * step)
    angular = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    return np.concatenate([angular, middle[:3, :3].T @ (last[:3, 3] - first[:3, 3]) / (2 * step)])


def _pooled(variance: Floats, error: Floats) -> tuple[Floats, Floats]:
    """(2,) of turns and of shifts together: the mean of three variances by their errors, and its error."""
    weight = np.maximum(error.reshape(2, 3) ** -2.0, 1e-30)
    return (weight * variance.reshape(2, 3)).sum(axis=1) / weight.sum(axis=1), weight.sum(axis=1) ** -0.5
