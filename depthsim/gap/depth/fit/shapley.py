"""How much of the gap each of several causes closes."""

from collections.abc import Mapping
from itertools import combinations, permutations

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.validate import Validator
from depthsim.gap.resampling import jackknife_half
from depthsim.sensor.effect import Effect

_Subset = frozenset[int]
_Sensors = Mapping[_Subset, tuple[Validator, tuple[Effect, ...], int]]
"""What each subset of the causes makes of the simulator, and by how many runs its gap is measured."""


def credit(
    validator: Validator, base: tuple[Effect, ...], model: Model, given: Validator | None = None
) -> tuple[float, ...]:
    """What each cause takes off the gap [bits per pixel]: the mean over all orders in which they may be added.

    given: the frames as they were recorded, where those of ``validator`` are registered: registering is then one more
    cause, the last. A cause that another one hides closes nothing until that is there, as errors that go together do
    not under coarse steps: where its mean is not above 0, it is taken after those that have no such mean. What still is
    below 0, as of a scale and an offset that cancel, has half of what it closes with the one that closes most.

    Together they take off what the whole model does, as the gap without any of them and with all is that which
    of :meth:`Validator.score`; what lies between is from fewer simulated runs.

    Source: Shapley, "A Value for n-Person Games", 1953.
    """
    sensors = _sensors(validator, base, model, given)
    gaps = {some: frames.quick(effects, runs) for some, (frames, effects, runs) in sensors.items()}
    return tuple(_shares(gaps, _hidden(gaps)).tolist())


def credit_and_error(
    validator: Validator, base: tuple[Effect, ...], model: Model, given: Validator | None = None
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """:func:`credit`, and half of the 95 % interval of each share of the gap that is closed.

    By the jackknife over blocks of frames, as frames that follow each other are alike; 0.5 of fewer than three.
    """
    sensors, count = _sensors(validator, base, model, given), len(validator.blocks)
    most = validator.config.runs_resampled
    frames, effects, _ = sensors[max(sensors, key=len)]
    left_out = [np.delete(np.arange(count), k) for k in range(count)] if count >= 3 else []
    gaps: dict[_Subset, float] = {}
    others: list[dict[_Subset, float]] = [{} for _ in left_out]
    for some, (of, with_some, runs) in sensors.items():  # subset by subset, as few simulated runs are kept
        gaps[some] = of.quick(with_some, runs)
        for left, blocks in zip(others, left_out, strict=True):
            left[some] = of.quick(with_some, min(runs, most), blocks)
    hidden = _hidden(gaps)
    shares = _shares(gaps, hidden)
    halves = np.full(len(shares), 0.5)
    if left_out:
        wholes = (
            x[_Subset()] - frames.between(effects, most, blocks) for x, blocks in zip(others, left_out, strict=True)
        )
        parts = [
            _shares(x, hidden) / whole if whole > 0 else 0 * shares for x, whole in zip(others, wholes, strict=True)
        ]
        halves = jackknife_half(np.array(parts))
    return tuple(shares.tolist()), tuple(np.hypot(halves, validator.config.least_error).tolist())


def _sensors(validator: Validator, base: tuple[Effect, ...], model: Model, given: Validator | None) -> _Sensors:
    config, parts, xs = validator.evidence.config, len(model.parts), model.split(model.x)
    runs = config.significance.runs, config.fit.runs_of_subset
    count = parts + (given is not None)
    found = {}
    for size in range(count + 1):
        for selected in combinations(range(count), size):
            frames = validator if given is None or parts in selected else given
            effects = base if frames is validator else frames.evidence.base
            for k in selected[: len(selected) - (parts in selected)]:
                effects = model.parts[k].build(effects, xs[k])
            found[_Subset(selected)] = frames, effects, runs[0] if size in (0, count) else runs[1]
    return found


def _hidden(gaps: Mapping[_Subset, float]) -> _Subset:
    """What closes nothing until the others are there; so are frames that are blurred by their poses, beside a large
    bias."""
    shares, last = _mean(gaps, _Subset()), _last(gaps)
    return _Subset(k for k in range(len(last)) if shares[k] <= 0 < last[k])


def _last(gaps: Mapping[_Subset, float]) -> list[float]:
    """What each cause closes beside all others."""
    every = max(gaps, key=len)
    return [gaps[every - {k}] - gaps[every] for k in range(len(every))]


def _mean(gaps: Mapping[_Subset, float], hidden: _Subset) -> NDArray[np.float64]:
    """What each cause closes in the mean over all orders in which what is hidden is last."""
    count = len(max(gaps, key=len))
    orders = [order for order in permutations(range(count)) if set(order[count - len(hidden) :]) == hidden]
    taken = np.zeros(count)
    for order in orders:
        for place, k in enumerate(order):
            taken[k] += gaps[_Subset(order[:place])] - gaps[_Subset(order[: place + 1])]
    return taken / len(orders)


def _shares(gaps: Mapping[_Subset, float], hidden: _Subset) -> NDArray[np.float64]:
    found = _mean(gaps, hidden)
    for k, last in enumerate(_last(gaps)) if hidden else ():
        if found[k] < 0 < last:
            both = [k, int(np.argmax(found))]
            found[both] = found[both].mean()
    return found
