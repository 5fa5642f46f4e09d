"""Blocks of time: what is correlated stays together, when data are held out and when they are resampled."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

Floats = NDArray[np.float64]

DRAWS = 1000


def contiguous(count: int, parts: int) -> NDArray[np.int_]:
    """(count,) which of ``parts`` stretches of equal length each item belongs to, in order."""
    return (np.arange(count) * min(parts, count)) // count


def block_weights(blocks: int, draws: int = DRAWS, seed: int = 0) -> Floats:
    """(draws, blocks) how often each block is drawn, with replacement; the same seed draws the same."""
    generator = np.random.Generator(np.random.Philox(key=[seed, 0xB10C]))
    return generator.multinomial(blocks, np.full(blocks, 1 / blocks), size=draws).astype(np.float64)


def percentile95(draws: Floats) -> tuple[float, float]:
    """The middle 95 % of values (draws,)."""
    low, high = np.percentile(draws, [2.5, 97.5])
    return float(low), float(high)


def jackknife(statistic: Callable[[NDArray[np.int64]], float], blocks: int) -> tuple[float, tuple[float, float]]:
    """The statistic of all blocks, and its 95 % interval by leaving out one at a time.

    statistic: of some blocks, by number. Of fewer than three blocks the interval is 0.5 to either side.
    """
    every = np.arange(blocks)
    value = float(statistic(every))
    if blocks < 3:
        return value, (value - 0.5, value + 0.5)
    half = float(jackknife_half(np.array([statistic(np.delete(every, k)) for k in range(blocks)])))
    return value, (value - half, value + half)


def jackknife_half(left_out: Floats) -> Floats:
    """(...) half of the 95 % interval of a statistic; left_out: (blocks, ...) it without each of three blocks or more.

    Of as many standard errors as Student's t has for so many blocks.
    """
    return np.asarray(np.sqrt(jackknife_variance(left_out)) * float(stdtrit(len(left_out) - 1, 0.975)))


def jackknife_variance(left_out: Floats) -> Floats:
    """(...) the variance of a statistic; left_out: (blocks, ...) it without each of two blocks or more.

    Source: Efron and Stein, "The Jackknife Estimate of Variance", 1981.
    """
    count = len(left_out)
    return np.asarray((count - 1) / count * ((left_out - left_out.mean(axis=0)) ** 2).sum(axis=0))


@dataclass(frozen=True)
class Paired:
    """The difference of two losses, block by block. mean: of a block. t: over its standard error."""

    mean: float
    t: float


def paired(one: Floats, other: Floats) -> Paired:
    """How sure it is that ``one`` (blocks,) is larger than ``other`` (blocks,), the same data held out twice."""
    difference = one - other
    mean = float(difference.mean())
    if len(difference) < 3:
        return Paired(mean, 0.0)
    error = float(difference.std(ddof=1) / np.sqrt(len(difference)))
    return Paired(mean, mean / error if error > 0 else float(np.sign(mean)) * np.inf)
