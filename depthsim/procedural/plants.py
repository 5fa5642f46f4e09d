"""Pot plants."""

import numpy as np

from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Part, join
from depthsim.procedural.primitives import cylinder, revolve
from depthsim.procedural.sweep import leaves, ribbons, tube


def pot(radius: float, height: float) -> Part:
    """A ceramic pot filled with soil."""
    r = radius
    profile = [(r * 0.72, 0), (r * 0.95, height * 0.85), (r, height * 0.85), (r, height), (r * 0.9, height)]
    return join(
        [
            revolve([*profile, (r * 0.66, 0.02), (0, 0.02)], 28, "ceramic"),
            cylinder(r * 0.87, 0.02, "soil", 28).moved(z=height * 0.87),
        ]
    )


def palm(stream: Stream, height: float = 1.5, fronds: int = 26) -> Part:
    """A pot plant with long arching blades, such as a dracaena or a palm."""
    base = 0.32
    yaw, lift = stream.uniform(0, 2 * np.pi, fronds), stream.uniform(0.25, 1.35, fronds)
    length = stream.uniform(0.28, 0.45, fronds) * height
    start = np.linspace(base + 0.25 * height, base + 0.55 * height, fronds)
    t = np.linspace(0, 1, 9)[None]
    out = length[:, None] * t * np.cos(lift)[:, None]
    up = start[:, None] + length[:, None] * (t * np.sin(lift)[:, None] - 0.55 * t**2.2)
    path = np.stack([out * np.cos(yaw)[:, None], out * np.sin(yaw)[:, None], up], axis=-1)
    across = np.stack([-np.sin(yaw), np.cos(yaw), np.zeros(fronds)], axis=1)[:, None]
    width = 0.022 * np.sqrt(np.maximum(np.sin(np.pi * np.linspace(0.08, 1, 9)), 0))[None, :, None]
    width[:, -1] = 0
    trunk = [(0, 0, base - 0.1), (0.02, 0.01, base + 0.25 * height), (0.0, 0.0, base + 0.56 * height)]
    return join(
        [pot(0.19, base), tube(trunk, [0.022, 0.018, 0.014], "bark", 8), ribbons(path, across * width, "foliage")]
    )


def bush(stream: Stream, height: float = 1.2, count: int = 260, vessel: tuple[float, float] = (0.2, 0.34)) -> Part:
    """A pot plant with twigs and oval leaves, such as a ficus."""
    top = vessel[1]
    tips = stream.directions(14) * (0.3, 0.3, 0.36) * height * stream.uniform(0.6, 1, (14, 1))
    tips[:, 2] += top + 0.58 * height
    twigs = [
        tube([(0, 0, top - 0.06), (*(0.35 * tip[:2]), 0.6 * top + 0.4 * tip[2]), tip], [0.012, 0.008, 0.003], "bark", 6)
        for tip in tips
    ]
    near = tips[stream.integers(14, count)]
    bases = near + stream.directions(count) * stream.uniform(0.02, 0.17, (count, 1)) * height
    along = stream.directions(count) * (1, 1, 0.5) - np.array([0, 0, 0.35])
    along *= stream.uniform(0.06, 0.1, (count, 1)) / np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, stream.directions(count))
    across *= 0.024 / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-3)
    return join([pot(*vessel), *twigs, leaves(bases, along, across, np.full(count, 0.008), "foliage")])
