"""Broken rock: single stones, rubble, heaps."""

import numpy as np
from numpy.typing import ArrayLike

from depthsim.procedural.noise import Stream, facets, fractal, smooth
from depthsim.procedural.part import Floats, Part, copies, join, rotation
from depthsim.procedural.primitives import icosphere

SHAPES = 6


def stone(seed: int, subdivisions: int = 2, rounded: float = 0.0, tag: str = "rock") -> Part:
    """One stone of about 1 m about the origin: broken (0) to round (1)."""
    ball = icosphere(subdivisions, tag)
    size = Stream(seed, 7).uniform(0.55, 1.0, 3) * (1, 1, 0.8)
    points = ball.vertices * size
    rough = 0.55 * (1 - rounded) * fractal(facets, points * 1.3, seed, 3) + 0.25 * fractal(smooth, points, seed + 1, 2)
    return Part.of(points * np.clip(0.55 + 0.5 * rough, 0.25, 1)[:, None], ball.faces, tag)


def rubble(
    stream: Stream, places: ArrayLike, sizes: ArrayLike, subdivisions: int = 1, rounded: float = 0.0, tag: str = "rock"
) -> Part:
    """Stones of about ``sizes`` (N,) [m] at ``places`` (N, 3), each turned its own way."""
    positions, scale = np.asarray(places, dtype=np.float64), np.asarray(sizes, dtype=np.float64)
    turns = rotation(*stream.uniform(0, 360, (3, len(positions)))) * scale[:, None, None]
    seeds = stream.integers(2**20, SHAPES)
    return join(
        copies(stone(int(seeds[kind]), subdivisions, rounded, tag), positions[kind::SHAPES], turns[kind::SHAPES])
        for kind in range(min(SHAPES, len(positions)))
    )


def heap(stream: Stream, count: int, radius: float, height: float, sizes: tuple[float, float]) -> tuple[Floats, Floats]:
    """Places (count, 3) and sizes (count,) of the stones of a conical heap on z = 0 about the origin."""
    angle, out = stream.uniform(0, 2 * np.pi, count), np.sqrt(stream.uniform(0, 1, count))
    z = height * (1 - out) * stream.uniform(0.55, 1.0, count)
    places = np.stack([radius * out * np.cos(angle), radius * out * np.sin(angle), z], axis=1)
    return places, sizes[0] + (sizes[1] - sizes[0]) * stream.uniform(0, 1, count) ** 2.5
