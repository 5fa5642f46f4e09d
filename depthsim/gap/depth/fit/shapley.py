"""How much of the gap each of several causes closes."""

from itertools import combinations, permutations

import numpy as np

from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import Effect


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
    config = validator.evidence.config
    runs = config.significance.runs, config.fit.runs_of_subset
    parts = len(model.parts)
    xs, count = model.split(model.x), parts + (given is not None)
    gaps: dict[frozenset[int], float] = {}
    for size in range(count + 1):
        for selected in combinations(range(count), size):
            frames = validator if given is None or parts in selected else given
            effects = base if frames is validator else frames.evidence.base
            for k in selected[: len(selected) - (parts in selected)]:
                effects = model.parts[k].build(effects, xs[k])
            gaps[frozenset(selected)] = frames.quick(effects, runs[0] if size in (0, count) else runs[1])

    def mean(orders: list[tuple[int, ...]]) -> tuple[float, ...]:
        taken = np.zeros(count)
        for order in orders:
            for place, k in enumerate(order):
                taken[k] += gaps[frozenset(order[:place])] - gaps[frozenset(order[: place + 1])]
        return tuple((taken / len(orders)).tolist())

    orders = list(permutations(range(count)))
    shares = mean(orders)
    last = [gaps[frozenset(range(count)) - {k}] - gaps[frozenset(range(count))] for k in range(count)]
    # So are frames that are blurred by their poses, beside a large bias.
    hidden = {k for k in range(count) if shares[k] <= 0 < last[k]}
    if not hidden:
        return shares
    found = np.array(mean([order for order in orders if set(order[count - len(hidden) :]) == hidden]))
    for k in range(count):
        if found[k] < 0 < last[k]:
            both = [k, int(np.argmax(found))]
            found[both] = found[both].mean()
    return tuple(found.tolist())
