"""A drone-race course in a hall: gates, flags, pylons, nets, a stand for people, a pit."""

from itertools import pairwise

import numpy as np

from depthsim.procedural import desktop, furniture, gates, walls
from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.hall import EAST, LENGTH, WIDTH, hall
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Floats, Part, copies, join, spin
from depthsim.procedural.primitives import box, boxes, cone, cushion, cylinder, torus
from depthsim.procedural.sweep import ribbons, tube

COURSE = (
    (6.0, 10.2, 1.4), (10.0, 9.0, 1.5), (17.0, 7.6, 1.5), (24.5, 8.4, 2.6), (31.5, 10.2, 1.7), (34.6, 13.8, 2.0),
    (31.0, 17.4, 1.6), (24.0, 17.2, 2.7), (17.0, 15.4, 1.5), (10.0, 16.8, 1.9), (6.0, 14.4, 1.6), (5.2, 12.2, 1.5),
)  # fmt: skip
"""The ideal line [m]; the race scene's trajectory goes through the same points."""


def race(seed: int = 1) -> Part:
    """A race course of nine gates in a hall of 40 m (x) by 24 m (y) and 8 m; the floor is z = 0.

    ``seed`` changes what lies about, not the gates.
    """
    stream = Stream(seed, 404)
    return join([*hall(), *_gates(), *_marks(stream), *_edge(stream), *_stand(stream), *_pit(stream)])


def _gates() -> list[Part]:
    """The gates, each square to the line through its neighbours."""
    line = np.array(COURSE)
    ahead = np.roll(line, -1, axis=0) - np.roll(line, 1, axis=0)
    yaw = np.degrees(np.arctan2(ahead[:, 1], ahead[:, 0]))
    kinds = {
        1: gates.banner_gate,
        2: gates.tower_gate,
        3: gates.banner_gate,
        4: gates.ring_gate,
        6: gates.banner_gate,
        7: gates.ring_gate,
        8: gates.arch_gate,
        9: gates.banner_gate,
    }
    parts = [kind(line[i, 2]).turned(yaw=yaw[i]).moved(line[i, 0], line[i, 1]) for i, kind in kinds.items()]
    return [*parts, gates.start_gate().turned(yaw=yaw[11]).moved(*line[11, :2])]


def _flag(stream: Stream, height: float) -> Part:
    """A feather flag: a bent pole with a cloth that waves a little; not closed, as cloth is."""
    t = np.linspace(0, 1, 14)
    pole = np.stack([t * 0 + 0.35 * np.clip(t - 0.75, 0, 1) ** 2 * 16, t * 0, 0.08 + (height - 0.08) * t], axis=1)
    width = 0.62 * np.sqrt(np.sin(np.pi * np.clip(0.06 + 0.94 * t[3:], 0, 0.995)))
    wave, phase = 0.07, stream.number(0, 6)
    columns = []
    for share in np.linspace(0, 1, 6):
        y = wave * np.sin(6 * share + 5 * t[3:] + phase) * share
        columns.append(np.stack([pole[3:, 0] + 0.02 + width * share, y, pole[3:, 2] - 0.12 * share], axis=1))
    strips = [ribbons(((a + b) / 2)[None], ((b - a) / 2)[None], "fabric") for a, b in pairwise(columns)]
    foot = [cone(0.2, 0.05, 0.09, "rubber", 20), cylinder(0.02, 0.2, "metal", 10)]
    return join([tube(pole, np.linspace(0.018, 0.008, 14), "plastic", 8), *strips, *foot])


def _marks(stream: Stream) -> list[Part]:
    """Flags and pylons along the course, lines on the floor, the start pad."""
    flags = [
        (13.5, 11.2),
        (20.8, 5.6),
        (28.2, 11.6),
        (36.6, 15.8),
        (27.4, 19.6),
        (20.4, 13.4),
        (13.4, 18.6),
        (3.6, 16.6),
    ]
    parts = [_flag(stream, stream.number(2.8, 3.6)).turned(yaw=stream.number(0, 360)).moved(x, y) for x, y in flags]
    pylon = join(
        [cone(0.16, 0.03, 0.62, "plastic", 20).moved(z=0.03), box((0.38, 0.38, 0.035), "rubber", (0, 0, 0.018))]
    )
    line = np.array([*COURSE, COURSE[0]])
    for start, end in pairwise(line):
        sideways = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm((end - start)[:2])
        places = [
            start[:2] + share * (end - start)[:2] + side * 1.7 * sideways for share in (0.3, 0.6) for side in (-1, 1)
        ]
        parts.append(copies(pylon, np.column_stack([places, np.zeros(4)]), spin(stream.uniform(0, 360, 4))))
    for y in (4.2, 21.6):
        parts.append(box((LENGTH - 6, 0.1, 0.006), "paint", (LENGTH / 2, y, 0.003)))
    pad = cylinder(0.6, 0.03, "rubber", 40)
    pads = [pad.moved(6.0 + 1.6 * i, 12.4) for i in range(4)]
    drones = [drone().turned(yaw=stream.number(-20, 20)).moved(6.0 + 1.6 * i, 12.4, 0.03) for i in range(4)]
    bar = join([cylinder(0.03, 4.0, "plastic", 12), cone(0.25, 0.06, 0.1, "rubber", 24)])
    bars = copies(
        bar, [(20.6, 9.6, 0), (13.8, 6.6, 0), (28.0, 7.4, 0), (27.4, 15.4, 0), (20.6, 18.0, 0), (13.6, 14.2, 0)]
    )
    return [*parts, *pads, *drones, bars]


def drone() -> Part:
    """A small quadrotor, 36 cm across, that stands on z = 0."""
    angle = np.arange(4) * 90.0 + 45
    arm = join(
        [
            box((0.13, 0.014, 0.008), "plastic", (0.075, 0, 0.06)),
            cylinder(0.014, 0.02, "metal", 12).moved(0.13, 0, 0.05),
            box((0.12, 0.012, 0.002), "plastic", (0.13, 0, 0.073)),
            torus(0.068, 0.003, "plastic", 20, 6).moved(0.13, 0, 0.073),
            cylinder(0.006, 0.06, "rubber", 8).moved(0.1, 0, 0),
        ]
    )
    return join(
        [
            copies(arm, np.zeros((4, 3)), spin(angle)),
            box((0.11, 0.05, 0.03), "plastic", (0, 0, 0.066)),
            box((0.075, 0.034, 0.028), "rubber", (0, 0, 0.095)),
            cylinder(0.011, 0.012, "glass", 12).turned(pitch=90).moved(0.056, 0, 0.07),
        ]
    )


def _edge(stream: Stream) -> list[Part]:
    """Barriers and stacks of tyres at the turns, the net before the stand, pads round two columns."""
    tyre = torus(0.22, 0.1, "rubber", 22, 10)
    stacks = [(36.9, 9.6 + 0.66 * i) for i in range(10)] + [(2.6, 9.8 + 0.66 * i) for i in range(9)]
    places = [(x + stream.number(-0.04, 0.04), y, 0.1 + 0.19 * level) for x, y in stacks for level in range(3)]
    barrier = blocks(
        Block("plastic", (-0.75, 0.75), (-0.22, 0.22), (0.0, 0.2)),
        Block("plastic", (-0.75, 0.75), (-0.12, 0.12), (0.2, 0.8)),
        Block(None, (-0.5, -0.2), (-0.22, 0.22), (0.0, 0.08)),
        Block(None, (0.2, 0.5), (-0.22, 0.22), (0.0, 0.08)),
    )
    row = copies(barrier, [(8 + 1.58 * i, 21.2, 0) for i in range(15)], spin(stream.uniform(-3, 3, 15)))
    return [copies(tyre, places), row, _net(np.array([6.0, 3.6, 0.0]), 28.0, 3.6)]


def _net(corner: Floats, length: float, height: float) -> Part:
    """A safety net along x with its posts: cords of 5 mm every 20 cm."""
    x, z = np.arange(0, length + 0.01, 0.2), np.arange(0.1, height, 0.2)
    upright = boxes([(0.005, 0.005, height)] * len(x), np.stack([x, x * 0, x * 0 + height / 2], 1), "fabric")
    level = boxes([(length, 0.006, 0.005)] * len(z), np.stack([z * 0 + length / 2, z * 0, z], 1), "fabric")
    posts = np.arange(0, length + 0.1, 4.0)
    poles = copies(cylinder(0.04, height + 0.1, "metal", 14), np.stack([posts, posts * 0 + 0.05, posts * 0], 1))
    rope = cylinder(0.01, length, "fabric", 8).turned(pitch=90).moved(z=height)
    return join([upright, level, poles, rope]).moved(*corner)


def _stand(stream: Stream) -> list[Part]:
    """Three steps of benches along the south wall, with bags and bottles left on them."""
    seats = [
        Block("wood", (10, 26), (2.2 - 0.7 * i, 2.5 - 0.7 * i), (0.42 + 0.4 * i, 0.46 + 0.4 * i)) for i in range(3)
    ]
    legs = [
        Block("metal", (x, x + 0.06), (2.32 - 0.7 * i, 2.38 - 0.7 * i), (0.0, 0.42 + 0.4 * i))
        for i in range(3)
        for x in np.arange(10.2, 26, 2.2)
    ]
    bags = [
        cushion((0.42, 0.26, 0.34), "fabric", 0.5, 20, 10)
        .turned(yaw=stream.number(0, 90))
        .moved(stream.number(10.5, 25.5), 2.35 - 0.7 * i, 0.62 + 0.4 * i)
        for i in (0, 0, 1, 1, 2)
    ]
    return [blocks(*seats, *legs), *bags]


def _pit(stream: Stream) -> list[Part]:
    """Tables with laptops, screens and drones in the corner behind the start, chairs, boxes."""
    table = join(
        [
            box((1.8, 0.75, 0.03), "plastic", (0, 0, 0.725)),
            *(
                tube([(x, -0.3, 0), (x, -0.3, 0.71), (x, 0.3, 0.71), (x, 0.3, 0)], 0.016, "metal", 8)
                for x in (-0.75, 0.75)
            ),
        ]
    )
    parts = []
    for i in range(4):
        things = [
            table,
            desktop.laptop().turned(yaw=stream.number(-20, 20)).moved(-0.4, 0.05, 0.7405),
            drone().turned(yaw=stream.number(0, 360)).moved(0.5, 0.05, 0.7405),
            desktop.mug().moved(0.05, 0.2, 0.7405),
            furniture.side_chair().turned(yaw=180 + stream.number(-30, 30)).moved(-0.3, -0.75),
        ]
        if i % 2:
            things.append(desktop.monitor(0.6).moved(0.15, 0.22, 0.7405))
        parts.append(join(things).moved(30.0 + 2.1 * i, 2.3))
    for x in (3.0, 3.7):
        parts.append(desktop.carton((0.6, 0.4, 0.4)).turned(yaw=stream.number(-15, 15)).moved(x, 20.8))
    parts.append(desktop.carton((0.5, 0.4, 0.35)).turned(yaw=12).moved(3.3, 20.8, 0.402))
    parts += [
        EAST.mount(walls.extinguisher(), 16.2, 0.7, 0.12),
        EAST.mount(walls.whiteboard(2.0, 1.2), 20.0, 1.2, 0.06),
    ]
    return [
        *parts,
        furniture.sofa(1.8).turned(yaw=90).moved(37.4, 20.5),
        furniture.waste_bin(0.25, 0.8).moved(29.0, WIDTH - 1.0),
    ]
