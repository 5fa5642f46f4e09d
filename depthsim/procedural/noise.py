"""Noise in space and streams of random numbers, the same bits on every machine and with every NumPy.

The noise is a hash of lattice points, the streams are raw Philox bits, so neither depends on how a version of NumPy
draws from a distribution.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Noise = Callable[[Floats, int], Floats]


class Stream:
    """Random numbers that depend on nothing but the key."""

    def __init__(self, *key: int) -> None:
        self._bits = np.random.Philox(np.random.SeedSequence([part & 0xFFFFFFFF for part in key]))

    def uniform(self, low: ArrayLike = 0.0, high: ArrayLike = 1.0, size: int | tuple[int, ...] = 1) -> Floats:
        """An array of uniform numbers in [low, high)."""
        raw = np.asarray(self._bits.random_raw(int(np.prod(size))), dtype=np.uint64).reshape(size)
        share = (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53
        start = np.asarray(low, dtype=np.float64)
        return np.asarray(start + share * (np.asarray(high, dtype=np.float64) - start))

    def number(self, low: float = 0.0, high: float = 1.0) -> float:
        """One uniform number in [low, high)."""
        return float(self.uniform(low, high)[0])

    def integers(self, stop: int, size: int) -> NDArray[np.int64]:
        """An array of whole numbers from 0 to ``stop`` - 1."""
        return self.uniform(0, stop, size).astype(np.int64)

    def directions(self, size: int) -> Floats:
        """(size, 3) unit vectors, even over the sphere."""
        z, angle = self.uniform(-1, 1, size), self.uniform(0, 2 * np.pi, size)
        r = np.sqrt(1 - z * z)
        return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def smooth(points: Floats, seed: int) -> Floats:
    """Value noise in [-1, 1], smooth, with features of about one unit, at (N, 3) points."""
    cell, inside = _split(points)
    weight = inside * inside * (3 - 2 * inside)
    result = np.zeros(len(points), np.float32)
    for corner in np.ndindex(2, 2, 2):
        share = np.ones(len(points), np.float32)
        for axis, side in enumerate(corner):
            share *= weight[axis] if side else 1 - weight[axis]
        result += share * _hash([cell[axis] + np.uint32(side) for axis, side in enumerate(corner)], seed)
    return result.astype(np.float64)


def facets(points: Floats, seed: int) -> Floats:
    """Noise in [-1, 1] that is linear on each tetrahedron of a lattice: flat faces and sharp edges, as broken rock.

    The lattice is the simplex one (Perlin 2001, "Noise hardware"), read by linear interpolation.
    """
    cell, inside = _split(points + points.sum(axis=1, keepdims=True) / 3)
    x, y, z = inside
    # Where each axis stands when the three coordinates are sorted downwards: the path through the cube's corners.
    x_over_y, x_over_z, y_over_z = x >= y, x >= z, y >= z
    place = [2 - (x_over_y * 1 + x_over_z), 1 - (y_over_z * 1 - x_over_y), 0 + (x_over_z * 1 + y_over_z)]
    first, last = np.maximum(np.maximum(x, y), z), np.minimum(np.minimum(x, y), z)
    middle = x + y + z - first - last
    result = np.zeros(len(points), np.float32)
    for step, share in enumerate((1 - first, first - middle, middle - last, last)):
        result += share * _hash([cell[axis] + (place[axis] < step).astype(np.uint32) for axis in range(3)], seed)
    return result.astype(np.float64)


def fractal(noise: Noise, points: Floats, seed: int, octaves: int, gain: float = 0.5) -> Floats:
    """A sum of ``noise`` at doubling frequencies, each ``gain`` times as strong as the one before."""
    total = np.zeros(len(points))
    for octave in range(octaves):
        total += gain**octave * noise(points * 2.03**octave + 17.3 * octave, seed + 1013 * octave)
    return total


def _split(points: Floats) -> tuple[list[NDArray[np.uint32]], NDArray[np.float32]]:
    """The lattice cell of each point, an array an axis, and where in it the point lies, (3, N) in [0, 1)."""
    floor = np.floor(points.T)
    return list(floor.astype(np.int64).astype(np.uint32)), (points.T - floor).astype(np.float32)


def _hash(cell: list[NDArray[np.uint32]], seed: int) -> NDArray[np.float32]:
    """A number in [-1, 1] for each lattice point."""
    u = np.uint32
    key = u((seed * 0x9E3779B1) & 0xFFFFFFFF)
    h = cell[0] * u(0x8DA6B343) ^ cell[1] * u(0xD8163841) ^ cell[2] * u(0xCB1AB31F) ^ key
    for shift, factor in ((15, 0x2C1B3C6D), (12, 0x297A2D39)):
        h ^= h >> u(shift)
        h *= u(factor)
    h ^= h >> u(15)
    return h.astype(np.float32) * np.float32(2.0**-31) - np.float32(1)
