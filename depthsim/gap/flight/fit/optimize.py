"""Fitting candidates to logs, and validating them on time that they were not fitted on.

The residuals of all channels are weighed by their noise, and fitted by Gauss-Newton. The validation is a
cross-validation over stretches of time: with the model linearised at the fit, a fit without a stretch is a small linear
system.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.flight.data.evidence import TILT, Problem, Values
from depthsim.gap.flight.data.simulate import Settings
from depthsim.gap.flight.effect import Candidate
from depthsim.gap.resampling import block_weights

_ROUNDS = 4
_SHORTER = 0.3
_CONVERGED = 1e-5
"""Of the loss: a step that promises less is not taken."""


@dataclass(frozen=True)
class Fit:
    """Formulas fitted together.

    values: of each candidate. residual: (n, C, A) at the fit. tilts: of the attitudes. columns: (n, C, A, P), the tilts
    first. squares: (blocks, C, A) squared residuals of each block when it was held out.
    """

    problem: Problem
    candidates: tuple[Candidate, ...]
    values: Values
    tilts: Floats
    residual: Floats
    columns: Floats

    @property
    def settings(self) -> Settings:
        """The model with these candidates."""
        return self.problem.settings(self.candidates, self.values)

    @property
    def effects(self) -> tuple[str, ...]:
        """The names of what is fitted."""
        return tuple(candidate.effect for candidate in self.candidates)

    @cached_property
    def sums(self) -> tuple[Floats, Floats, Floats]:
        """Block sums: (B, C, A, P, P), (B, C, A, P), (B, C, A)."""
        starts = [*self.problem.starts.tolist(), len(self.residual)]
        x = np.ascontiguousarray(np.moveaxis(self.columns, 0, 2))
        r = np.ascontiguousarray(np.moveaxis(self.residual, 0, 2))
        xx, xr, rr = [], [], []
        for low, high in pairwise(starts):
            part, own = x[:, :, low:high], r[:, :, low:high]
            xx.append(np.swapaxes(part, -1, -2) @ part)
            xr.append((np.swapaxes(part, -1, -2) @ own[..., None])[..., 0])
            rr.append((own**2).sum(axis=-1))
        return np.stack(xx), np.stack(xr), np.stack(rr)

    @cached_property
    def normal(self) -> tuple[Floats, Floats, Floats, Floats]:
        """Weighed normal equations by block (B, P, P), (B, P), and the tilts' prior (P,) with its pull (P,)."""
        xx, xr, _ = self.sums
        w = self.problem.weights
        matrix, vector = np.einsum("bcapq,ca->bpq", xx, w), np.einsum("bcap,ca->bp", xr, w)
        prior, pull = np.zeros(vector.shape[1]), np.zeros(vector.shape[1])
        count = len(self.tilts)
        prior[:count] = 1 / TILT**2
        pull[:count] = -self.tilts / TILT**2
        return matrix, vector, prior, pull

    @cached_property
    def steps(self) -> Floats:
        """(folds, P) how the parameters change when a fold is left out."""
        matrix, vector, prior, pull = self.normal
        out = np.zeros((self.problem.folds.max() + 1, len(prior)))
        low, high = self.room
        for fold in range(len(out)):
            shared, own = self.problem.training(fold)
            total, right = matrix[shared].sum(axis=0), vector[shared].sum(axis=0)
            said = np.diagonal(total) > 0
            # What is the log's own comes second, beside what all logs share.
            for kept, blocks in ((said, shared), (~said, own)):
                if not kept.any():
                    continue
                if blocks is not shared:
                    total, right = matrix[blocks].sum(axis=0), vector[blocks].sum(axis=0)
                beside = right[kept] - total[np.ix_(kept, ~kept)] @ out[fold, ~kept] + pull[kept]
                inner = total[np.ix_(kept, kept)] + np.diag(prior[kept])
                out[fold, kept] = _solve(inner, beside, (low[kept], high[kept]))
        return out

    @property
    def room(self) -> tuple[Floats, Floats]:
        """(P,) how far each parameter may go down and up; tilts anywhere."""
        return _room(self.candidates, self.values, len(self.tilts))

    @cached_property
    def squares(self) -> Floats:
        """(B, C, A) squared residuals of each block, held out."""
        xx, xr, rr = self.sums
        step = self.steps[self.problem.folds]
        cross = np.einsum("bcap,bp->bca", xr, step)
        return np.asarray(np.maximum(rr - 2 * cross + np.einsum("bp,bcapq,bq->bca", step, xx, step), 0.0))

    @cached_property
    def held_out(self) -> Floats:
        """(n, C, A) residual of each sample when its block was held out."""
        step = self.steps[self.problem.folds[self.problem.blocks]]
        return np.asarray(self.residual - np.einsum("ncap,np->nca", self.columns, step))

    @cached_property
    def loss(self) -> Floats:
        """(B,) weighed, of the blocks for selecting, with the tilts' improbability shared out over them."""
        loss = np.einsum("bca,ca->b", self.squares, self.problem.weights)[self.problem.selecting]
        return np.asarray(loss + (self.tilts**2).sum() / TILT**2 / len(loss))

    def draws(self, count: int, seed: int) -> Floats:
        """(count, P) how the parameters change when blocks are drawn anew, within their bounds; drawn once.

        Of few blocks the draws scatter too little: they are as wide as Student's t for as many has it.
        """
        from scipy.special import stdtrit

        if (count, seed) in self._drawn:
            return self._drawn[count, seed]
        matrix, vector, prior, pull = self.normal
        free = max(len(vector) - vector.shape[1], 2)
        wider = float(stdtrit(free, 0.975)) / 1.96 * np.sqrt(len(vector) / free)
        left = vector.sum(axis=0) + pull
        room = self.room
        found = [
            _solve(np.tensordot(one, matrix, 1) + np.diag(prior), wider * (one @ vector + pull - left) + left, room)
            for one in block_weights(len(vector), count, seed)
        ]
        return self._drawn.setdefault((count, seed), np.stack(found))

    @cached_property
    def _drawn(self) -> dict[tuple[int, int], Floats]:
        return {}

    @cached_property
    def extensions(self) -> "dict[Candidate, Fit]":
        """Fits with one candidate more, which selections that begin alike ask for again."""
        return {}

    def parts(self, columns: Floats) -> list[Floats]:
        """The columns (..., P) of each candidate."""
        ends = len(self.tilts) + np.cumsum([0, *(len(numbers) for numbers in self.values)])
        return [columns[..., low:high] for low, high in pairwise(ends.tolist())]


def empty_fit(problem: Problem) -> Fit:
    """No candidate at all, only the tilts."""
    return _iterate(problem, (), (), np.zeros(problem.tilts.shape[-1]), None)


def extended(fit: Fit, candidate: Candidate) -> Fit:
    """A fit with one candidate more; the columns of the others are taken over from before."""
    if candidate not in fit.extensions:
        candidates, values = (*fit.candidates, candidate), (*fit.values, tuple(candidate.starts))
        fit.extensions[candidate] = _iterate(fit.problem, candidates, values, fit.tilts, fit.columns)
    return fit.extensions[candidate]


def refitted(problem: Problem, candidates: Sequence[Candidate], values: Values | None = None) -> Fit:
    """Formulas fitted together from the start."""
    starts = values if values is not None else tuple(tuple(candidate.starts) for candidate in candidates)
    return _iterate(problem, tuple(candidates), starts, np.zeros(problem.tilts.shape[-1]), None)


def _iterate(
    problem: Problem, candidates: tuple[Candidate, ...], values: Values, tilts: Floats, known: Floats | None
) -> Fit:
    """Gauss-Newton; a step that makes it worse is taken shorter. known: columns that are kept, of the tilts and of all
    candidates but the last."""
    fresh = range(len(candidates)) if known is None else range(len(candidates) - 1, len(candidates))
    linear = all(candidates[index].linear for index in fresh)
    best: Fit | None = None
    least, step, turns = np.inf, np.zeros(0), 0
    new: list[Floats] = []
    for _ in range(2 * _ROUNDS):
        predicted = problem.predict(problem.settings(candidates, values))
        residual = problem.measured - predicted - problem.tilts @ tilts
        loss = _whole_loss(problem, residual, tilts)
        if best is not None and not loss <= least:
            if loss - least < _CONVERGED * least or np.abs(step).max() == 0:
                break
            step = _SHORTER * step
            values, tilts = _moved(candidates, best.values, step[len(tilts) :]), best.tilts + step[: len(tilts)]
            continue
        if not (linear and new):
            new = [_columns(problem, candidates, values, index, predicted) for index in fresh]
        columns = np.concatenate([problem.tilts if known is None else known, *new], axis=-1)
        converged = best is not None and least - loss < max(0.05, _CONVERGED * loss)
        best, least = Fit(problem, candidates, values, tilts, residual, columns), loss
        turns += 1
        if not columns.shape[-1] or (linear and turns == 2) or turns == _ROUNDS or (converged and not linear):
            break
        matrix, vector, prior, pull = best.normal
        step = _solve(matrix.sum(axis=0) + np.diag(prior), vector.sum(axis=0) + pull, best.room)
        values, tilts = _moved(candidates, values, step[len(tilts) :]), tilts + step[: len(tilts)]
    assert best is not None
    return best


def _whole_loss(problem: Problem, residual: Floats, tilts: Floats) -> float:
    return float(np.einsum("nca,nca,ca->", residual, residual, problem.weights) + (tilts**2).sum() / TILT**2)


def _columns(
    problem: Problem, candidates: tuple[Candidate, ...], values: Values, index: int, predicted: Floats
) -> Floats:
    """(n, C, A, P) of one candidate, by finite differences."""
    candidate = candidates[index]
    found = np.empty((*predicted.shape, len(candidate.parameters)))
    if candidate.columns is not None:
        return candidate.columns(problem.records, found)
    for place, parameter in enumerate(candidate.parameters):
        numbers = list(values[index])
        numbers[place] += parameter.step
        other = (*values[:index], tuple(numbers), *values[index + 1 :])
        found[..., place] = (problem.predict(problem.settings(candidates, other)) - predicted) / parameter.step
    return found


def _moved(candidates: tuple[Candidate, ...], values: Values, step: Floats) -> Values:
    found, at = [], 0
    for candidate, numbers in zip(candidates, values, strict=True):
        moved = np.array(numbers) + step[at : at + len(numbers)]
        low, high = zip(*((each.low, each.high) for each in candidate.parameters), strict=True)
        found.append(tuple(np.clip(moved, low, high).tolist()))
        at += len(numbers)
    return tuple(found)


def _room(candidates: Sequence[Candidate], values: Values, tilts: int) -> tuple[Floats, Floats]:
    bounds = [(one.low, one.high) for candidate in candidates for one in candidate.parameters]
    low, high = np.array(bounds).reshape(-1, 2).T
    now = np.array([value for numbers in values for value in numbers])
    free = np.full(tilts, np.inf)
    return np.concatenate([-free, np.minimum(low - now, 0)]), np.concatenate([free, np.maximum(high - now, 0)])


def _solve(matrix: Floats, vector: Floats, room: tuple[Floats, Floats]) -> Floats:
    """Least squares within bounds (P,) each; what the data do not determine stays as it is."""
    scale = np.sqrt(np.maximum(np.diagonal(matrix), 1e-300))
    powers, vectors = np.linalg.eigh(matrix / np.outer(scale, scale))
    known = powers > 1e-9 * max(powers.max(initial=0.0), 1e-300)
    root, turned = np.sqrt(powers[known]), vectors[:, known]
    target = (turned.T @ (vector / scale)) / root
    step = turned @ (target / root)
    low, high = (np.asarray(end * scale) for end in room)
    if (step < low).any() or (step > high).any():
        from scipy.optimize import lsq_linear

        gap = 1e-9 * (1 + np.abs(step))  # lsq_linear wants some room everywhere
        step = lsq_linear(root[:, None] * turned.T, target, (low - gap, high + gap), method="bvls").x
    return np.asarray(np.clip(step / scale, *room))
