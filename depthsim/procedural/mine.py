"""What stands about in a mine; each thing stands on z = 0 about the origin."""

import numpy as np

from depthsim.procedural import rock
from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Part, join, rotation
from depthsim.procedural.primitives import box, boxes, cylinder, lying, revolve
from depthsim.procedural.sweep import circle, sweep, tube


def tub(stream: Stream) -> Part:
    """A tipping tub full of ore, along x; its wheels stand on z = 0."""
    profile = [(0.36, 0.32), (0.56, 0.95), (0.53, 0.95), (0.345, 0.35)]
    hull = revolve(profile, 4, "metal", closed=True).turned(yaw=45).scaled(1.35, 0.95, 1.0)
    floor = box((0.66, 0.46, 0.03), "metal", (0, 0, 0.335))
    rim = sweep([(0.55, -0.39, 0.95), (0.55, 0.39, 0.95), (-0.55, 0.39, 0.95), (-0.55, -0.39, 0.95)], 0.022, circle(8),
                "metal", ring=True)  # fmt: skip
    chassis = blocks(
        Block("metal", (-0.62, 0.62), (-0.2, 0.2), (0.2, 0.3)),
        Block(None, (-0.55, 0.55), (-0.13, 0.13), (0.2, 0.3)),
        Block("metal", (-0.7, -0.62), (-0.06, 0.06), (0.21, 0.29)),
        Block("metal", (0.62, 0.7), (-0.06, 0.06), (0.21, 0.29)),
        Block("metal", (-0.3, -0.22), (-0.2, 0.2), (0.2, 0.34)),
        Block("metal", (0.22, 0.3), (-0.2, 0.2), (0.2, 0.34)),
    )
    wheel = join(
        [cylinder(0.15, 0.045, "metal", 24).moved(z=-0.022), cylinder(0.175, 0.012, "metal", 24).moved(z=0.024)]
    )
    wheels = [wheel.turned(roll=s * 90).moved(x, s * -0.3, 0.15) for x in (-0.33, 0.33) for s in (-1, 1)]
    axles = [lying(cylinder(0.025, 0.6, "metal", 10)).turned(yaw=90).moved(x, -0.3, 0.15) for x in (-0.33, 0.33)]
    places, sizes = rock.heap(stream, 60, 0.42, 0.3, (0.1, 0.24))
    ore = rock.rubble(stream, places * (1, 0.72, 1) + (0, 0, 0.86), sizes, 2)
    core = rock.stone(int(stream.integers(2**20, 1)[0]), 2, 0.5).scaled(0.95, 0.66, 0.5).moved(z=0.86)
    return join([hull, floor, rim, chassis, *wheels, *axles, ore, core])


def drum() -> Part:
    """A steel drum with two ribs."""
    rib = [(0.29, 0.0), (0.305, 0.0), (0.305, 0.02), (0.29, 0.02)]
    side = [(r, z + at) for at in (0.3, 0.6) for r, z in rib]
    return revolve([(0.29, 0.0), *side, (0.29, 0.88)], 28, "metal")


def crate() -> Part:
    """A wooden crate with battens at its ends."""
    return blocks(
        Block("wood", (-0.35, 0.35), (-0.25, 0.25), (0.0, 0.42)),
        *(Block(None, (-0.35, 0.35), (y - 0.006, y + 0.006), (0.412, 0.42)) for y in (-0.12, 0.0, 0.12)),
        *(
            Block(None, (-0.35, 0.35), (s * 0.25 - 0.008, s * 0.25 + 0.008), (z, z + 0.015))
            for s in (-1, 1)
            for z in (0.13, 0.27)
        ),
        *(Block("wood", (s * 0.36 - 0.02, s * 0.36 + 0.02), (-0.26, 0.26), (0.0, 0.43)) for s in (-1, 1)),
    )


def ladder() -> Part:
    """A ladder that leans towards +y."""
    return join(
        [tube([(s * 0.2, 0, 0), (s * 0.2, 0.75, 2.7)], 0.02, "wood", 8) for s in (-1, 1)]
        + [tube([(-0.2, y, y * 3.6), (0.2, y, y * 3.6)], 0.014, "wood", 8) for y in np.arange(0.08, 0.72, 0.08)]
    )


def planks(stream: Stream) -> Part:
    """A low stack of planks along x."""
    places = [(stream.number(-0.1, 0.1), stream.number(-0.05, 0.05), 0.06 + 0.041 * i) for i in range(5)]
    return boxes([(3.0, 0.18, 0.04)] * 5, places, "wood", rotation(yaw=stream.uniform(-4, 4, 5)))


def hose() -> Part:
    """A coiled hose."""
    angle = np.linspace(0, 6 * np.pi, 90)
    coil = np.stack([0.35 * np.cos(angle), 0.35 * np.sin(angle), 0.05 + angle * 0.006], axis=1)
    return tube(coil, 0.03, "rubber", 10)
