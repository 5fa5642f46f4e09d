"""Fitting: the parameters at which the simulator's histograms come nearest to the recording's."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.config import DepthFit
from depthsim.gap.depth.fit.candidate import Candidate, Vector
from depthsim.gap.depth.fit.free import Free
from depthsim.sensor.effect import Effect, effect_class

Floats = NDArray[np.float64]
Roots = Callable[[tuple[Effect, ...]], Floats]
_COMB = tuple(sign * move for move in (0.02, 0.04, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0) for sign in (1, -1))
"""Moves by which other minima near one are found, in changes that matter."""
_BEYOND, _MUCH = 0.05, 0.5
"""The part of the way to a place where a fit may begin, by less of which it is far beyond the recording; and of what
another place promises, so much of which is enough where it is nearer."""
_FIRST_DAMPING = 1e-3
_DAMPED, _AS_PROMISED = 0.01, 0.8
"""A step that is damped by less, and takes off what the slopes promise, to this share, ends where they have their
least: twice as long a one would take off nothing."""


@dataclass(frozen=True)
class Model:
    """Several candidates at once, each at a place of its own: ``x`` is all their free parameters in a row."""

    parts: tuple[Candidate, ...]
    x: Vector
    loss: float = np.inf
    jacobian: Floats | None = None

    @property
    def free(self) -> tuple[Free, ...]:
        """The parameters that are fitted, in the order of ``x``."""
        return tuple(free for part in self.parts for free in part.free)

    @property
    def effects(self) -> list[type[Effect]]:
        """What each candidate is."""
        return [effect_class(part.effect) for part in self.parts]

    def split(self, x: Vector) -> list[Vector]:
        """``x`` by candidate."""
        if not self.parts:
            return []
        return np.split(x, np.cumsum([len(part.free) for part in self.parts])[:-1])

    def build(self, base: Sequence[Effect], x: Vector | None = None) -> tuple[Effect, ...]:
        """The sensor with all of them."""
        effects = tuple(base)
        for part, own in zip(self.parts, self.split(self.x if x is None else x), strict=True):
            effects = part.build(effects, own)
        return effects

    def parameters(self, number: int) -> dict[str, Any]:
        """The parameters of one candidate."""
        return self.parts[number].parameters(self.split(self.x)[number])

    def bounded(self, x: Vector) -> Vector:
        """``x`` within the bounds of the parameters."""
        return np.array([f.encode(f.decode(v)) for f, v in zip(self.free, x, strict=True)])

    @property
    def newest(self) -> "Model":
        """What was added last, by itself."""
        return Model(self.parts[-1:], self.split(self.x)[-1])

    def plus(self, other: "Model") -> "Model":
        """Both together."""
        return Model((*self.parts, *other.parts), np.concatenate([self.x, other.x]))

    def in_order_of(self, other: "Model") -> "Model":
        """The same with its parts as in ``other``, which has the same ones."""
        if self.parts == other.parts:
            return self
        xs = dict(zip(map(repr, self.parts), self.split(self.x), strict=True))
        return Model(other.parts, np.concatenate([xs[repr(part)] for part in other.parts]), self.loss)

    def less(self, number: int) -> "Model":
        """Without one candidate; the slopes of the others stay, as far as they are known."""
        others = np.repeat(np.arange(len(self.parts)), [len(part.free) for part in self.parts]) != number
        slopes = None if self.jacobian is None else self.jacobian[:, others]
        return Model((*self.parts[:number], *self.parts[number + 1 :]), self.x[others], jacobian=slopes)


def loss(target: Floats, found: Floats) -> float:
    """Squared distance of the roots of two sets of histograms."""
    return float(np.square(target - found).sum())


def starts(
    candidate: Candidate, base: Sequence[Effect], here: Floats, target: Floats, roots: Roots
) -> tuple[list[Model], float]:
    """The places where a candidate begins, best first, and what of the loss any of them would take off, going on.

    The best one is the nearest to the recording, unless another promises much more somewhere on the way to it: light
    from the right side that is much too strong is further off than such from another side, where little is lit. In
    that order the others follow. What is far beyond the recording promises nothing, and where a candidate may begin
    with nothing slopes are known there.

    here: what ``base`` does, without it. Where a candidate begins with nothing, that is not known: infinite.
    """
    tries, gains, promised = [], [], []
    for values in candidate.starts:
        x = candidate.encode(values)
        there = roots(candidate.build(base, x))
        done = there - here
        size, toward = float((done * done).sum()), float((done * (target - here)).sum())  # no BLAS, see refine
        gains.append(toward**2 / size if size > 0 else np.inf)
        part = min(max(toward / size, 0.0), 1.0) if size > 0 else 0.0
        tries.append(Model((candidate,), x, loss(target, there)))
        promised.append(part * (2 * toward - part * size) if part > _BEYOND else 0.0)
    nearest = min(range(len(tries)), key=lambda k: tries[k].loss)
    if np.inf in gains or loss(target, here) - tries[nearest].loss >= _MUCH * max(promised):
        promised[nearest] = np.inf
    order = sorted(range(len(tries)), key=lambda k: (-promised[k], tries[k].loss))
    return [tries[k] for k in order], max(gains)


def promised(
    model: Model, base: Sequence[Effect], here: Floats, target: Floats, roots: Roots, config: DepthFit
) -> float:
    """What of the loss slopes promise that a first step takes off, where a model begins.

    Slopes over a whole change that matters: over a small one, rays that are bent by less than a step of the disparity
    hardly move a pixel into another bin.

    here: what it does there.
    """
    jacobian = _jacobian(model, base, model.x, here, roots, 1.0, both_sides=False)
    normal, gradient = _normal(jacobian, target - here)
    return _promise(normal, gradient, _step(normal, gradient, _FIRST_DAMPING, config))


def refine(
    model: Model,
    base: Sequence[Effect],
    target: Floats,
    roots: Roots,
    config: DepthFit,
    rounds: int,
    both_sides: bool = False,
) -> Model:
    """Levenberg–Marquardt. The random numbers are the same at every step, so that the loss is smooth.

    It ends when a round takes no more than config.least_gain off the loss. Most of the loss is chance, as long as
    there are many bins: what distinguishes one value of a parameter from the next is a small part of it.

    both_sides: slopes from a move to either side. Part of the chance is drawn anew by a move, and by moves to one side
    alone the parameters would drift to that side.

    Rare bins grow as the root of a strength, and steps from a strength of nothing come out too short: a step that
    helps, but not as the slopes promise, is doubled for as long as it goes on helping.

    scipy.optimize.least_squares (trf, the same slopes and bounds) was tried on four recordings: on one of them it lost
    two of three causes, and it took 1.3 and 2.3 times as long on the two that were timed.
    """
    x, damping = model.x.copy(), _FIRST_DAMPING
    if not len(x):
        return model
    here = roots(model.build(base, x))
    least = loss(target, here)
    jacobian = None
    for _ in range(rounds):
        jacobian = _jacobian(model, base, x, here, roots, config.trial, both_sides)
        normal, gradient = _normal(jacobian, target - here)
        before = least
        for _ in range(3):
            step = _step(normal, gradient, damping, config)
            tried = model.bounded(x + step)
            there = roots(model.build(base, tried))
            new = loss(target, there)
            if new < least:
                break
            damping = max(damping * 30, 0.1)
        else:
            break
        origin, went = x, tried - x
        promise = _promise(normal, gradient, went)
        as_promised = _AS_PROMISED * promise < before - new < promise / _AS_PROMISED
        doublings = 0 if damping < _DAMPED and as_promised else 4
        x, here, least, damping = tried, there, new, damping / 10
        for _ in range(doublings):
            step = 2 * step
            further = model.bounded(origin + step)
            if np.allclose(further, x):
                break
            there = roots(model.build(base, further))
            if loss(target, there) >= least:
                break
            x, here, least = further, there, loss(target, there)
        if before - least < config.least_gain * least or np.abs(x - origin).max() < 5 * config.least_gain:
            break
    return Model(model.parts, x, least, jacobian)


def polish(
    model: Model, base: Sequence[Effect], target: Floats, roots: Roots, config: DepthFit, sizes: Sequence[float]
) -> Model:
    """Each parameter up and down in turn, for what has no useful slope: steps, and noise that is drawn anew.

    Whole numbers first, each with the others fitted to it.
    """
    x, least = model.x.copy(), loss(target, roots(model.build(base, model.x)))
    for k in [k for k, free in enumerate(model.free) if free.whole]:
        for sign in (1, -1):
            moved = x.copy()
            moved[k] += sign
            if np.allclose(moved := model.bounded(moved), x):
                continue
            fitted = refine(Model(model.parts, moved), base, target, roots, config, 2)
            if fitted.loss < least:
                x, least = fitted.x, fitted.loss
                break
    for size in sizes:
        for k in range(len(x)):
            for sign in (1, -1):
                moved = x.copy()
                moved[k] += sign * size
                moved = model.bounded(moved)
                new = loss(target, roots(model.build(base, moved))) if not np.allclose(moved, x) else np.inf
                if new < least:
                    x, least = moved, new
                    break
    return Model(model.parts, x, least, model.jacobian)


def neighbours(model: Model) -> Iterator[tuple[int, Vector]]:
    """Places beside the model's where the loss may have other minima: which parameter is moved, and ``x`` with it.

    Of what resamples the picture. Which pixels are doubled repeats itself, nearly, when the zoom makes the picture a
    pixel wider at its border, so the loss has a minimum for each such zoom.
    """
    at = 0
    for part in model.parts:
        for k in range(at, at + len(part.free)) if effect_class(part.effect).moves_camera else ():
            for move in _COMB:
                moved = model.x.copy()
                moved[k] += move
                yield k, model.bounded(moved)
        at += len(part.free)


def best_neighbour(model: Model, base: Sequence[Effect], target: Floats, roots: Roots) -> Model:
    """The model, or the one of its :func:`neighbours` that is nearest to the target."""
    places = [model.x, *(x for _, x in neighbours(model))]
    if len(places) == 1:
        return model
    losses = [loss(target, roots(model.build(base, x))) for x in places]
    best = int(np.argmin(losses))
    return Model(model.parts, places[best], losses[best], model.jacobian)


def _normal(jacobian: Floats, left: Floats) -> tuple[Floats, Vector]:
    """The matrix of the normal equations and their right side."""
    # By einsum, as BLAS would wake threads of its own for so little, and let them spin beside ours.
    return np.einsum("bi,bj->ij", jacobian, jacobian), np.einsum("bi,b->i", jacobian, left)


def _step(normal: Floats, gradient: Vector, damping: float, config: DepthFit) -> Vector:
    damped = normal + damping * np.diag(np.diag(normal)) + 1e-12 * np.eye(len(gradient))
    return np.clip(np.linalg.solve(damped, gradient), -config.longest_step, config.longest_step)


def _promise(normal: Floats, gradient: Vector, step: Vector) -> float:
    """What of the loss a step takes off, if the slopes stay as they are."""
    return float((step * (2 * gradient - (normal * step).sum(axis=1))).sum())


def _jacobian(
    model: Model, base: Sequence[Effect], x: Vector, here: Floats, roots: Roots, trial: float, both_sides: bool
) -> Floats:
    columns = []
    for k in range(len(x)):
        moved, size = _moved(model, x, k, (trial, -trial))
        there = roots(model.build(base, moved))
        back, back_size = _moved(model, x, k, (-trial,)) if both_sides else (x, 0.0)
        if back_size * size < 0:
            columns.append((there - roots(model.build(base, back))) / (size - back_size))
        else:
            columns.append((there - here) / size)
    return np.stack(columns, axis=1)


def _moved(model: Model, x: Vector, k: int, sizes: Sequence[float]) -> tuple[Vector, float]:
    """``x`` with one parameter moved, by the first of ``sizes`` that its bounds allow, and by how much."""
    free, moved = model.free[k], x.copy()
    for size in sizes:
        moved[k] = free.encode(free.decode(x[k] + size))
        if abs(moved[k] - x[k]) > 0.5 * abs(size):
            break
    return moved, float(moved[k] - x[k]) or abs(size)
