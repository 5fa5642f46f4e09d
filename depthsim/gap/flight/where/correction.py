"""How much of a residual a correction closes that is learned on one axis, on time held out."""

from dataclasses import dataclass

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.flight.data.axes import Axis, State
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.fit.series import Series, free_series

_RIDGES = (1e-7, 1e-4, 1e-2, 1.0)
"""Over the mean information of a column."""


@dataclass(frozen=True)
class Learned:
    """A correction on an axis. gains: (B,) of the weighed held-out loss. residual: (n, A) what is left [m/s²].

    closed: share of the power above the noise, of all axes of the body.
    """

    axis: str
    simple: float
    gains: Floats
    residual: Floats
    closed: float

    @property
    def rank(self) -> float:
        """For ordering."""
        return self.closed - self.simple


def learn(problem: Problem, residual: Floats, axis: Axis, state: State, noise: Floats) -> Learned:
    """A ridge regression on the axis' columns. residual: (n, A) of the first channel. noise: (A,)."""
    columns = axis.columns(state)[:, list(problem.records.axes)]
    columns = columns[:, :, np.abs(columns).max(axis=(0, 1)) > 1e-9]
    if not columns.shape[2]:  # such as the altitude, where only the lateral force is known
        return _learned(problem, residual, residual, axis.name, axis.simple, noise)
    scale = np.sqrt((columns**2).mean(axis=(0, 1)))
    columns = columns / scale
    weights = problem.weights[0]
    folds = problem.folds[problem.blocks]
    xw = np.sqrt(weights)[:, None] * columns
    rw = np.sqrt(weights) * residual
    count = folds.max() + 1
    matrices = np.stack([_gram(xw[folds == fold]) for fold in range(count)])
    vectors = np.stack(
        [np.tensordot(xw[folds == fold], rw[folds == fold], axes=((0, 1), (0, 1))) for fold in range(count)]
    )
    total, whole = matrices.sum(axis=0), vectors.sum(axis=0)
    best: Floats | None = None
    for ridge in _RIDGES:
        prior = np.eye(len(whole)) * ridge * np.trace(total) / len(whole)
        left = np.empty_like(residual)
        for fold in range(count):
            theta = np.linalg.solve(total - matrices[fold] + prior, whole - vectors[fold])
            rows = folds == fold
            left[rows] = residual[rows] - columns[rows] @ theta
        if best is None or (weights * left**2).sum() < (weights * best**2).sum():
            best = left
    assert best is not None
    return _learned(problem, residual, best, axis.name, axis.simple, noise)


def learn_time(problem: Problem, residual: Floats, noise: Floats) -> tuple[Learned, Series]:
    """Whatever comes and goes within seconds: knots in time, validated by interpolation."""
    series = free_series(problem, residual)
    left = residual - series.predicted[:, 0]
    return _learned(problem, residual, left, "time", 0.15, noise), series


def _gram(x: Floats) -> Floats:
    flat = x.reshape(-1, x.shape[-1])
    return np.asarray(flat.T @ flat)


def _learned(problem: Problem, residual: Floats, left: Floats, name: str, simple: float, noise: Floats) -> Learned:
    weights = problem.weights[0]
    gains = np.add.reduceat(((residual**2 - left**2) * weights).sum(axis=1), problem.starts)
    excess = float((residual**2).sum() - len(residual) * (noise**2).sum())
    closed = float((residual**2).sum() - (left**2).sum()) / excess if excess > 0 else 0.0
    return Learned(name, simple, gains, left, float(np.clip(closed, -1.0, 1.0)))
