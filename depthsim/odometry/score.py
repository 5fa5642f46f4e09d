"""Scoring an estimated trajectory against the true one, by evo."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from depthsim.errors import InputError
from depthsim.extras import load_extra
from depthsim.trajectory import Trajectory

STEP = 1.0
"""[m] Drift is the error of relative poses this far apart along the true path."""
DIFFERENCE = 0.01
"""[s] Poses belong together when their stamps differ by no more."""


@dataclass(frozen=True)
class Score:
    """How far an estimate is from the truth; metres and degrees. What is not known is not a number.

    matched: poses that were compared. path: length of the true path. ate: root mean square of the distances after the
    best alignment by a rigid motion (absolute trajectory error); ate_max: their greatest. rpe: root mean square of the
    translation error between neighbouring frames; rpe_deg: of the rotation error. drift: mean translation error over
    stretches of a metre of the true path, per metre; drift_deg: of the rotation, in degrees per metre.
    Definitions: Sturm et al., IROS 2012; evo's APE and RPE.
    """

    matched: int
    path: float
    ate: float
    ate_max: float
    rpe: float
    rpe_deg: float
    drift: float
    drift_deg: float


def score(truth: Trajectory, estimate: Trajectory) -> Score:
    """Compare an estimate with the truth at the stamps that both have, aligned by a rigid motion.

    Raises :class:`InputError` where fewer than three stamps match.
    """
    reference, aligned = align(truth, estimate)
    metrics = load_extra("evo.core.metrics", "slam")
    part, unit = metrics.PoseRelation, metrics.Unit
    ape = metrics.APE(part.translation_part)
    ape.process_data((reference, aligned))
    rpe = [_relative((reference, aligned), relation, 1, unit.frames) for relation in _relations(part)]
    drift = [_relative((reference, aligned), relation, STEP, unit.meters) for relation in _relations(part)]
    return Score(
        matched=reference.num_poses,
        path=float(reference.path_length),
        ate=float(ape.get_statistic(metrics.StatisticsType.rmse)),
        ate_max=float(ape.get_statistic(metrics.StatisticsType.max)),
        rpe=_rms(rpe[0]),
        rpe_deg=_rms(rpe[1]),
        drift=_mean(drift[0]) / STEP,
        drift_deg=_mean(drift[1]) / STEP,
    )


def align(truth: Trajectory, estimate: Trajectory) -> tuple[Any, Any]:
    """Both as evo's trajectories, at the same stamps, the estimate moved rigidly onto the truth (Umeyama 1991)."""
    sync, geometry = load_extra("evo.core.sync", "slam"), load_extra("evo.core.geometry", "slam")
    try:
        reference, other = sync.associate_trajectories(_evo(truth), _evo(estimate), max_diff=DIFFERENCE)
    except sync.SyncException:
        reference = None
    if reference is None or reference.num_poses < 3:
        span = f"{truth.stamps[0]:.3f} to {truth.stamps[-1]:.3f} s"
        problem = "has fewer than three stamps in common with the truth"
        raise InputError(estimate.name, "", problem, f"give poses with the stamps of the run, {span}")
    try:
        other.align(reference)
    except geometry.GeometryException:
        # Where all points lie on a line, or stand still, the turn about it is free: the first pose says it.
        other.align_origin(reference)
    return reference, other


def _evo(trajectory: Trajectory) -> Any:
    module = load_extra("evo.core.trajectory", "slam")
    wxyz = trajectory.quaternions[:, [3, 0, 1, 2]]
    return module.PoseTrajectory3D(trajectory.positions.copy(), wxyz, trajectory.stamps.copy())


def _relations(part: Any) -> tuple[Any, Any]:
    return part.translation_part, part.rotation_angle_deg


def _relative(pair: tuple[Any, Any], relation: Any, delta: float, unit: Any) -> np.ndarray:
    """The errors of relative poses; none where the true path is too short for one."""
    metrics = load_extra("evo.core.metrics", "slam")
    # evo measures stretches along the estimate unless asked otherwise: one of half the size then drifts twice as much.
    rpe = metrics.RPE(
        relation, delta, unit, all_pairs=unit == metrics.Unit.meters, rel_delta_tol=0.1, pairs_from_reference=True
    )
    try:
        rpe.process_data(pair)
    except load_extra("evo.core.filters", "slam").FilterException:
        return np.empty(0)
    return np.asarray(rpe.error)


def _rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(errors**2))) if errors.size else float("nan")


def _mean(errors: np.ndarray) -> float:
    return float(np.mean(errors)) if errors.size else float("nan")
