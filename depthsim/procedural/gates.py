"""Gates of a drone race, seen along x; the middle of the opening is above the origin at height ``z`` [m]."""

import numpy as np

from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.part import Part, join
from depthsim.procedural.primitives import box, cushion, cylinder, torus
from depthsim.procedural.sweep import circle, frame, sweep, tube


def banner_gate(z: float, legs: bool = True) -> Part:
    """A square gate, 1.5 m clear about height ``z``: printed cloth on a frame of plastic pipe, seen along x."""
    cloth = blocks(
        Block("fabric", (-0.012, 0.012), (-1.08, 1.08), (z - 1.0, z + 1.08)),
        Block(None, (-0.012, 0.012), (-0.75, 0.75), (z - 0.75, z + 0.75)),
    )
    pipes = [
        frame(2.18, 2.1, 0.05, "plastic", 0.12).moved(z=z + 0.04),
        frame(1.52, 1.52, 0.04, "plastic", 0.08).moved(z=z),
    ]
    if legs:
        for side in (-1, 1):
            pipes += [
                tube([(0, side * 1.09, 0.0), (0, side * 1.09, z)], 0.026, "plastic", 10),
                tube([(-0.5, side * 1.09, 0.03), (0.5, side * 1.09, 0.03)], 0.026, "plastic", 10),
                cushion((0.42, 0.26, 0.16), "fabric", 0.5, 18, 8).moved(0.25, side * 1.09, 0.1),
                cushion((0.42, 0.26, 0.16), "fabric", 0.5, 18, 8).moved(-0.25, side * 1.09, 0.1),
            ]
    return join([cloth, *pipes])


def tower_gate(z: float) -> Part:
    """Two square gates on top of one another."""
    return join([banner_gate(z), banner_gate(z + 2.2, legs=False)])


def ring_gate(z: float) -> Part:
    """A padded ring of 1.8 m clear on a post with a foot."""
    turn = torus(1.02, 0.11, "fabric", 48, 12).turned(pitch=90).moved(z=z)
    bands = [
        torus(0.12, 0.016, "plastic", 16, 6)
        .turned(pitch=90)
        .moved(y=0)
        .turned(roll=90)
        .moved(y=1.02)
        .turned(roll=a)
        .moved(z=z)
        for a in range(15, 360, 30)
    ]
    foot = [box((0.9, 0.12, 0.05), "metal", (0, 0, 0.025)), box((0.12, 0.9, 0.05), "metal", (0, 0, 0.026))]
    return join([turn, *bands, *foot, cylinder(0.045, z - 1.1, "metal", 14).moved(z=0.02)])


def arch_gate(z: float) -> Part:
    """An inflated arch of 2.6 m clear with its guy ropes."""
    angle = np.linspace(-0.2, np.pi + 0.2, 33)
    path = np.stack([angle * 0, 1.7 * np.cos(angle), 0.35 + 2.1 * np.sin(angle) * z / 1.5], axis=1)
    seams = 0.3 - 0.035 * (np.arange(33) % 4 == 0)
    ropes = [tube([(0, s * 1.75, 1.6), (e, s * 2.3, 0.02)], 0.006, "fabric", 6) for s in (-1, 1) for e in (-1.2, 1.2)]
    return join([sweep(path, seams, circle(20), "fabric"), *ropes])


def start_gate() -> Part:
    """A portal of lattice girders with lights and a clock."""
    rods, height, half = [], 3.4, 2.2
    for offset in ((-0.12, -0.12), (0.12, -0.12), (0.12, 0.12), (-0.12, 0.12)):
        for side in (-1, 1):
            x, y = offset[0], side * half + offset[1]
            rods.append(tube([(x, y, 0.0), (x, y, height + 0.12)], 0.02, "metal", 8))
        rods.append(
            tube([(offset[0], -half, height + offset[1]), (offset[0], half, height + offset[1])], 0.02, "metal", 8)
        )
    for i in range(13):
        z = 0.1 + i * 0.26
        for side in (-1, 1):
            d = 0.12 if i % 2 else -0.12
            for x in (-0.12, 0.12):
                rods.append(tube([(x, side * half - d, z), (x, side * half + d, z + 0.26)], 0.009, "metal", 6))
        y = -half + 0.2 + i * 0.32
        rods += [tube([(x, y, height - 0.12), (x, y + 0.3, height + 0.12)], 0.009, "metal", 6) for x in (-0.12, 0.12)]
    lights = [
        cylinder(0.09, 0.06, "glass", 18).turned(pitch=90).moved(0.13, y, height - 0.3)
        for y in (-0.6, -0.3, 0.0, 0.3, 0.6)
    ]
    feet = [box((0.6, 0.6, 0.03), "metal", (0, s * half, 0.015)) for s in (-1, 1)]
    return join([*rods, *lights, *feet, box((0.1, 1.6, 0.26), "plastic", (0.09, 0, height - 0.3))])
