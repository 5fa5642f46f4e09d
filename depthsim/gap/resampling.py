"""Blocks of time: what is correlated stays together, when data are held out and when they are resampled."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

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


@dataclass(frozen=True)
class Paired:
    """The difference of two losses, block by block. mean: of a block. t: over its standard error."""

    mean: float
    t: float


def paired(one: Floats, other: Floats) -> Paired:
    """How sure it is that ``one`` (blocks,) is larger than ``other`` (blocks,), the same data judged twice."""
    difference = one - other
    mean = float(difference.mean())
    if len(difference) < 3:
        return Paired(mean, 0.0)
    error = float(difference.std(ddof=1) / np.sqrt(len(difference)))
    return Paired(mean, mean / error if error > 0 else float(np.sign(mean)) * np.inf)
