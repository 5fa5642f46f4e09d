"""How far the poses of a recording are off from frame to frame, and the poses without that.

A frame's residuals are explained by three parts together: what the sensor does alike in all frames (a bias by pixel
and by disparity, other optics, a scale that drifts, a mount that is turned, late stamps, rows one after another: the
nuisances of :mod:`~depthsim.gap.depth.data.rigid`), a rigid motion of the frame's own, and noise. The first is
left in the recording; only the second is an error of its poses: see :mod:`~depthsim.gap.depth.data.mixed_model`. What
a motion does to a pixel holds to first order only, so the scene is cast anew from where the camera is by then.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtri

from depthsim.gap.depth.data.equations import Equations, equations
from depthsim.gap.depth.data.mixed_model import FINE, MixedModel
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.data.rigid import Floats, Look
from depthsim.parallel import core_count
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.sensor.motion import Motion
from depthsim.trajectory import Trajectory
from depthsim.trajectory.rotation import multiply, turned

ROUNDS = 3
"""How often the scene is cast anew from where the camera is by now."""
_SAMPLES = 40_000
"""Pixels of a frame that its motion is at last determined by, about."""
_LEAST_PIXELS = 200
"""A frame with fewer says nothing."""
_SURE, _ONE = 0.999, 3.3
"""What is alike in all frames is a mount's or late stamps' where random errors leave as much on average in 1 of 1000
recordings; that many standard errors of one number."""
_NOTHING = 1e-9
"""The prior of what is held at 0."""
_TUKEY = 4.685
_LEAST_NOISE = 0.01
"""[px] The noise is never taken for less."""


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

    def applied(self, run: Run, constant: bool = False) -> Run:
        """The run with its poses corrected; between frames that were looked at corrections are interpolated.

        constant: whether to correct what is alike in all frames, too.
        """
        if self.errors.is_none:
            return run
        corrections = self.corrections + (np.nan_to_num(self.errors.constant) if constant else 0)
        trajectory, truth = (_corrected(p, self.stamps, corrections) for p in (run.trajectory, run.truth))
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
    looked_at = sorted(set(range(len(run)) if frames is None else frames))

    def found(*, of_optics: bool) -> Registration:
        return _Work(run, caster, looked_at, threads, of_optics=of_optics).done()

    def is_none(one: Registration) -> bool:
        return one.errors.is_none or one.errors.are_of_others

    plain = found(of_optics=False)
    # What other optics do may look like errors of the poses. They are asked only then, see :attr:`Look.priors`.
    beside_optics = plain if is_none(plain) else found(of_optics=True)
    return beside_optics if is_none(beside_optics) else plain


class _Work(MixedModel):
    """The alternation of casting and solving."""

    def __init__(
        self, run: Run, caster: Caster, frames: Sequence[int], threads: int | None, *, of_optics: bool
    ) -> None:
        self.run, self.frames, self.threads = run, list(frames), threads or core_count()
        self.look = Look.at(run, caster, of_optics=of_optics)
        self._each(self.look.load)
        self.look.cut_disparities(self.frames[:: max(1, len(self.frames) // 20)])
        super().__init__(frames, run.stamps[self.frames].astype(float), self.look.priors, self.look.in_time)
        self.paths = run.trajectory, run.truth
        self.motion = Motion.along(*self.paths)
        self.noise = np.full((2, 1), np.nan)

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
        alike = self.beta[:7].copy(), self.beta_error[:7].copy()
        of_disparity = self._of_disparity() if self.variance.any() else 0.0
        if self.variance.any():
            self._tell_apart()
            if self.variance.any():
                self._refine()
        covariance = self._posterior()
        of_frame = np.sqrt(np.einsum("nii->ni", covariance).reshape(-1, 2, 3).mean(axis=(0, 2)))
        errors = replace(
            self._errors(alike),
            along_motion=self._along_motion(),
            repeated=self._repeated(),
            of_disparity=of_disparity,
            of_frame=(float(of_frame[0]), float(of_frame[1])),
        )
        return Registration(np.array(self.frames, np.int64), self.stamps, self.random, covariance, errors)

    def _tell_apart(self) -> None:
        """Take for random what is alike in all frames, where it is no more than random errors leave on average."""
        free = self.priors
        # Errors that last are fewer than the frames.
        lasting = self._lasting()
        # Three means over a variance that is known from what the frames say of three directions (Fisher's F).
        most = 3 * float(fdtri(3, 3 * max(len(self.frames) / lasting - 1, 1), _SURE))
        held = np.zeros(self.count, np.bool_)
        for part in (slice(0, 3), slice(3, 6)):
            mount, covariance = self.beta[part], lasting * self.beta_covariance[part, part]
            held[part] = mount @ np.linalg.solve(covariance, mount) < most
        # Of poses that jitter, those of a moment between two frames are their mean, and fit better than either. So late
        # stamps are tried against the motion of the registered camera.
        held[6] = True
        self._again(np.where(held, _NOTHING, free))
        registered = Motion.along(*(_corrected(path, self.stamps, self.random) for path in self.paths))
        twist = np.array([_twist(registered, stamp) for stamp in self.stamps])
        trust = twist / np.maximum(self.variance, FINE**2)
        information = max(float((trust * twist).sum()), 1e-12)
        late = float((trust * self.random).sum()) / information
        if late**2 > _ONE**2 * self._lasting() / information:
            held[6] = False
            self._again(np.where(held, _NOTHING, free))

    def _of_disparity(self) -> float:
        """See :class:`PoseErrors`: an offset and a scale of the disparities of each frame."""
        shapes = np.zeros((self.count, 2))
        shapes[self.look.by_disparity] = np.stack([np.ones(len(self.look.knots)), self.look.knots], axis=1)
        motions = self._gained()
        return self._gained_by(shapes) / motions if motions > 0 else 0.0

    def _along_motion(self) -> float:
        """See :class:`PoseErrors`. Turns and shifts are weighted by how large they are."""
        recorded = Motion.along(self.run.trajectory, self.run.truth)
        twist = np.array([_twist(recorded, stamp) for stamp in self.stamps])
        size = np.repeat((self.random**2).reshape(-1, 2, 3).mean(axis=(0, 2)), 3)
        moved = np.where(self.random.any(axis=0), 1 / np.maximum(size, 1e-24), 0)  # a direction that is not shown is 0
        along = (self.random * moved * twist).sum(axis=1) ** 2 / np.maximum((moved * twist**2).sum(axis=1), 1e-24)
        whole = float((moved * self.random**2).sum())
        return float(along.sum() / whole) if whole > 0 else 0.0

    def _repeated(self) -> float:
        """See :class:`PoseErrors`: a camera at rest without noise has the same picture, too."""
        same: list[bool] = []
        for (one, before), (other, after) in pairwise((index, self.run.depth_raw(index)) for index in self.frames):
            if other == one + 1 and not np.array_equal(self.run.poses[one], self.run.poses[other]):
                same.append(np.array_equal(before, after))
        return float(np.mean(same)) if same else 0.0

    def _again(self, priors: Floats) -> None:
        self.priors = priors
        for _ in range(2):
            self._cast()
            self._solve()

    def _refine(self) -> None:
        """The motions from more of the pixels, with the nuisances as they were found."""
        knots = self.look.knots
        self.look = Look.at(self.run, self.look.caster, _SAMPLES, of_optics=self.look.of_optics)
        self.look.knots = knots
        self._each(self.look.load)
        self._cast(solved=True)
        # Finer samples have more of their noise in common.
        said, resolution, expected = self._halves_say()
        self.inflation *= self._grown(said[0] - said[1], expected.sum(axis=0), resolution)
        self.random = np.array([self._predicted(halves)[0] for halves in self.halves])

    def _cast(self, solved: bool = False) -> None:
        """The normal equations of every frame's halves, from where it is by now. solved: the nuisances are known."""
        none = np.zeros((6, self.count)), np.zeros((self.count,) * 2), np.zeros(self.count)
        place = {index: k for k, index in enumerate(self.frames)}

        def one(index: int) -> tuple[list[Equations], Floats, Floats]:
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
            enough = np.count_nonzero(inside) >= _LEAST_PIXELS
            parts = [np.flatnonzero((seen.half == which) & inside & enough) for which in (0, 1, 2)]
            if solved:
                left, slopes = target - seen.nuisance @ self.beta, np.ascontiguousarray(seen.rigid)
                known = (equations(slopes, left, weight, part) for part in parts)
                halves = [Equations(one.jj, none[0], none[1], one.j, none[2]) for one in known]
            else:
                halves = [equations(seen.nuisance, target, weight, part) for part in parts]
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


def _twist(motion: Motion, stamp: float, step: float = 0.015) -> Floats:
    """(6,) the camera's velocity in its own axes [rad/s] and [m/s], over twice ``step`` [s]: recorded poses jitter."""
    first, middle, last = motion.at([stamp - step, stamp, stamp + step])
    turn = first[:3, :3].T @ last[:3, :3] / (4 * step)
    angular = [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    return np.concatenate([angular, middle[:3, :3].T @ (last[:3, 3] - first[:3, 3]) / (2 * step)])
