"""The two processes of Dryden turbulence, discretised exactly and begun in their stationary distribution."""

import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

GUST_STEP = 0.01
"""[s] Gusts are drawn this far apart and joined by straight lines."""


def first_order(draws: Floats, deviation: float, constant: float) -> Floats:
    """(V, M) draws to the process with deviation σ and a time constant [s]."""
    keep = math.exp(-GUST_STEP / constant)
    fresh = math.sqrt(1 - keep * keep)
    out = np.empty_like(draws)
    state = out[:, 0] = draws[:, 0]
    for index in range(1, draws.shape[1]):
        state = out[:, index] = keep * state + fresh * draws[:, index]
    return deviation * out


def second_order(draws: Floats, deviation: float, constant: float) -> Floats:
    """(V, M, 2) draws to the process of filter (1 + √3 τ s) / (1 + τ s)², with deviation σ.

    The state is (p, τ dp/dt) of τ² d²p/dt² + 2 τ dp/dt + p = noise, scaled to unit variance each; they are independent.
    """
    x = GUST_STEP / constant
    decay = math.exp(-x)
    turn = np.array([[1 + x, x], [-x, 1 - x]]) * decay
    spread = np.linalg.cholesky(np.eye(2) - turn @ turn.T + 1e-15 * np.eye(2))
    p, q = draws[:, 0, 0], draws[:, 0, 1]
    out = np.empty(draws.shape[:2])
    out[:, 0] = p + math.sqrt(3) * q
    for index in range(1, draws.shape[1]):
        a, b = draws[:, index, 0], draws[:, index, 1]
        p, q = (
            turn[0, 0] * p + turn[0, 1] * q + spread[0, 0] * a,
            turn[1, 0] * p + turn[1, 1] * q + spread[1, 0] * a + spread[1, 1] * b,
        )
        out[:, index] = p + math.sqrt(3) * q
    return deviation / 2 * out
