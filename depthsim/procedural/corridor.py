"""A corridor of an institute: doors, pillars, lamps, a polished floor, and all that hangs on its walls."""

import numpy as np

from depthsim.procedural import desktop, furniture, plants, walls
from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Part, copies, join
from depthsim.procedural.primitives import box, boxes, cylinder, lying, torus
from depthsim.procedural.sweep import SQUARE, sweep, tube
from depthsim.procedural.walls import Wall

LENGTH, HALF, HEIGHT = 26.0, 1.25, 2.9
SIDE_X, SIDE_Y = (16.6, 18.8), 7.0
ALCOVE = (6.2, 9.4)
WEST, EAST, SOUTH, NORTH = Wall(0, 0.0, -1), Wall(0, LENGTH, 1), Wall(1, -HALF, -1), Wall(1, HALF, 1)
SIDE_WEST, SIDE_EAST, SIDE_END = Wall(0, SIDE_X[0], -1), Wall(0, SIDE_X[1], 1), Wall(1, SIDE_Y, 1)
ALCOVE_BACK = Wall(1, -HALF - 0.75, -1)
SOUTH_DOORS, NORTH_DOORS, PILLARS = (
    (2.2, 4.9, 11.4, 14.0, 19.2, 22.6),
    (3.1, 7.4, 10.6, 13.6, 21.4),
    (0.9, 5.9, 9.8, 15.2, 20.3, 24.2),
)


def corridor(seed: int = 1) -> Part:
    """A corridor of 26 m along x, 2.5 m wide and 2.9 m high, with a side arm to +y at 17 m and an alcove.

    The floor is z = 0 and y = 0 the middle line. ``seed`` changes what hangs and lies about.
    """
    stream = Stream(seed, 303)
    return join([_shell(), *_ceiling(), *_doors(), *_walls(stream), *_floor(stream)])


def _shell() -> Part:
    items = [
        Block("tile", (-0.5, LENGTH + 0.5), (-3.0, SIDE_Y + 0.5), (-0.3, 0.0)),
        Block("formboard", (-0.5, LENGTH + 0.5), (-3.0, SIDE_Y + 0.5), (HEIGHT, HEIGHT + 0.3)),
        Block(None, (0, LENGTH), (-HALF, HALF), (0, HEIGHT)),
        Block(None, SIDE_X, (HALF, SIDE_Y), (0, HEIGHT)),
        Block(None, ALCOVE, (-HALF - 0.75, -HALF), (0, 2.45)),
    ]
    for wall, along in (
        (SOUTH, (0, ALCOVE[0])), (SOUTH, (ALCOVE[1], LENGTH)), (NORTH, (0, SIDE_X[0])), (NORTH, (SIDE_X[1], LENGTH)),
        (SIDE_WEST, (HALF, SIDE_Y)), (SIDE_EAST, (HALF, SIDE_Y)), (ALCOVE_BACK, ALCOVE),
    ):  # fmt: skip
        items.append(wall.block("rubber", along, (-0.012, 0), (0, 0.1)))
    for x in PILLARS:
        for wall in (SOUTH, NORTH):
            items.append(wall.block("cement", (x - 0.18, x + 0.18), (-0.16, 0), (0, HEIGHT)))
            items.append(wall.block("cement", (x - 0.21, x + 0.21), (-0.19, 0), (0, 0.14)))
        items.append(Block("cement", (x - 0.18, x + 0.18), (-HALF, HALF), (HEIGHT - 0.22, HEIGHT)))
    for x in SOUTH_DOORS:
        items += walls.door(SOUTH, x)
    for x in NORTH_DOORS:
        items += walls.door(NORTH, x, glazed=True)
    # Double doors of glass at both ends, a window at the end of the side arm.
    for wall in (WEST, EAST):
        for side in (-1, 1):
            items += walls.door(wall, side * 0.5, 0.94, 2.1, glazed=True)
    items += walls.window(SIDE_END, (SIDE_X[0] + 0.35, SIDE_X[1] - 0.35), (0.8, 2.3))
    return blocks(*items, around="plaster")


def _ceiling() -> list[Part]:
    """Lamps, a cable tray and two pipes below the beams, sprinklers, emergency signs."""
    lamps = [walls.ceiling_lamp(1.2, 0.3).moved(x, 0.0, HEIGHT) for x in (2.3, 4.4, 7.2, 8.9, 11.7, 13.7, 18.5, 22.2)]
    lamps += [walls.ceiling_lamp(1.2, 0.3).turned(yaw=90).moved(17.7, y, HEIGHT) for y in (2.6, 5.2)]
    level = HEIGHT - 0.34
    tray = blocks(
        Block("metal", (0.0, LENGTH), (-1.05, -0.75), (level, level + 0.06)),
        Block(None, (0.0, LENGTH), (-1.047, -0.753), (level + 0.003, level + 0.06)),
    )
    rungs = np.arange(0.4, LENGTH, 0.8)
    hangers = boxes(
        [(0.03, 0.34, 0.03)] * len(rungs), np.stack([rungs, rungs * 0 - 0.9, rungs * 0 + level - 0.015], 1), "metal"
    )
    rods = boxes(
        [(0.01, 0.01, 0.4)] * len(rungs), np.stack([rungs, rungs * 0 - 1.06, rungs * 0 + level + 0.18], 1), "metal"
    )
    s = np.linspace(0.05, LENGTH - 0.05, 90)
    cables = [
        tube(
            np.stack([s, -1.0 + 0.055 * i + 0.008 * np.sin(1.3 * s + i), level + 0.014 + s * 0], 1), 0.011, "rubber", 6
        )
        for i in range(4)
    ]
    pipes = [lying(cylinder(r, LENGTH, "metal", 18)).moved(0, y, level + r) for y, r in ((0.92, 0.055), (0.74, 0.035))]
    clamp = torus(0.062, 0.008, "metal", 18, 6).turned(pitch=90)
    clamps = copies(clamp, [(x, 0.92, level + 0.055) for x in np.arange(1.5, LENGTH, 2.6)])
    heads = [
        join([cylinder(0.012, 0.06, "metal", 8), cylinder(0.03, 0.006, "metal", 14)]).moved(x, 0.25, HEIGHT - 0.055)
        for x in np.arange(1.6, LENGTH, 3.1)
    ]
    exit_sign = join(
        [box((0.03, 0.36, 0.18), "plastic", (0, 0, -0.14)), box((0.012, 0.012, 0.08), "metal", (0, 0, -0.02))]
    )
    signs = [exit_sign.moved(x, 0.0, HEIGHT) for x in (6.6, 16.0)]
    return [*lamps, tray, hangers, rods, *cables, *pipes, clamps, *heads, *signs]


def _doors() -> list[Part]:
    """Levers, closers and the plates with the names beside the doors."""
    parts = []
    for wall, positions in ((SOUTH, SOUTH_DOORS), (NORTH, NORTH_DOORS)):
        for x in positions:
            parts += [
                wall.mount(walls.lever(), x - 0.37, 1.05, -0.05),
                wall.mount(walls.sign(0.2, 0.14), x + 0.72, 1.6),
                wall.mount(box((0.28, 0.05, 0.06), "metal", (0, -0.015, 0)), x + 0.2, 1.98, -0.05),
            ]
    for wall in (WEST, EAST):
        for side in (-1, 1):
            parts.append(wall.mount(furniture.handle(0.5).scaled(1.6), side * 0.09, 1.15, -0.05))
    return parts


def _walls(stream: Stream) -> list[Part]:
    parts = [
        NORTH.mount(walls.notice_board(1.6, 1.0, stream, 9), 5.0, 1.1),
        SOUTH.mount(walls.notice_board(1.2, 0.9, stream, 5), 12.7, 1.15),
        NORTH.mount(walls.extinguisher(), 1.65, 0.6),
        NORTH.mount(walls.extinguisher(), 12.2, 0.6),
        SOUTH.mount(_hose_cabinet(), 17.2, 0.6),
        NORTH.mount(furniture.clock(), 9.0, 2.15),
        NORTH.mount(walls.radiator(1.3, 0.6), 23.3, 0.2, 0.0),
        SIDE_END.mount(walls.radiator(1.3, 0.5), 17.7, 0.2, 0.0),
        SIDE_EAST.mount(walls.whiteboard(1.6, 1.0), 3.4, 1.0),
        ALCOVE_BACK.mount(walls.sign(1.4, 0.9, "paper"), 7.8, 1.7),
    ]
    parts += [SOUTH.mount(walls.switch(), x, 1.15) for x in (3.75, 10.3, 13.0, 20.8)]
    parts += [NORTH.mount(walls.switch(), x, 0.3) for x in (8.3, 11.6, 14.5)]
    # A handrail on brackets along the north wall, between the doors.
    for low, high in ((19.1, 20.05), (22.05, 23.9), (14.25, 15.0)):
        parts.append(tube([(low, HALF - 0.07, 0.92), (high, HALF - 0.07, 0.92)], 0.021, "wood", 12))
        for x in (low + 0.1, high - 0.1):
            parts.append(
                tube([(x, HALF + 0.01, 0.86), (x, HALF - 0.07, 0.86), (x, HALF - 0.07, 0.91)], 0.008, "metal", 8)
            )
    return parts


def _hose_cabinet() -> Part:
    """A fire-hose cabinet with a reel behind glass, back in y = 0."""
    shell = blocks(
        Block("paint", (-0.36, 0.36), (-0.2, 0.0), (0, 0.8)),
        Block(None, (-0.31, 0.31), (-0.2, -0.02), (0.05, 0.75)),
    )
    reel = [
        torus(0.19 - 0.02 * i, 0.022, "rubber", 28, 8).turned(roll=90).moved(0, -0.06 - 0.03 * i, 0.4) for i in range(3)
    ]
    hub = cylinder(0.06, 0.12, "metal", 16).turned(roll=90).moved(0, -0.02, 0.4)
    return join([shell, *reel, hub])


def _floor(stream: Stream) -> list[Part]:
    """What stands on the floor: benches, plants, bins, a trolley, cartons, a mat."""
    mat = box((1.4, 1.7, 0.016), "carpet", (1.1, 0, 0.008))
    slats = [box((2.2, 0.085, 0.03), "wood", (0, -0.18 + 0.1 * i, 0.44)) for i in range(4)]
    frames = [
        sweep([(x, -0.2, 0.0), (x, -0.2, 0.42), (x, 0.15, 0.42), (x, 0.15, 0.0)], 0.018, SQUARE, "metal")
        for x in (-0.9, 0.9)
    ]
    bench = join([*slats, *frames]).moved(7.6, -HALF - 0.42)
    chairs = [
        furniture.side_chair().turned(yaw=180 + stream.number(-8, 8)).moved(x, HALF - 0.36) for x in (4.55, 5.1, 22.3)
    ]
    return [
        mat,
        bench,
        *chairs,
        plants.palm(stream, 1.5).moved(9.05, -HALF - 0.36),
        plants.bush(stream, 1.2).moved(18.45, 6.55),
        plants.palm(stream, 1.2).moved(25.55, 0.95),
        furniture.waste_bin(0.16, 0.5, "metal").moved(14.85, 1.0),
        furniture.waste_bin(0.16, 0.5, "metal").moved(6.5, -HALF - 0.5),
        _trolley(stream).turned(yaw=4).moved(20.9, -0.85),
        desktop.carton((0.5, 0.4, 0.35)).turned(yaw=7).moved(23.55, -0.98),
        desktop.carton((0.42, 0.34, 0.28)).turned(yaw=-9).moved(23.55, -0.98, 0.352),
        furniture.cabinet(0.9, 1.0, 0.4).turned(yaw=90).moved(SIDE_X[0] + 0.21, 4.2),
        desktop.book_stack(stream).moved(SIDE_X[0] + 0.22, 4.0, 1.0),
    ]


def _trolley(stream: Stream) -> Part:
    """A two-deck trolley with cartons on it, along x."""
    decks = [
        blocks(
            Block("metal", (-0.45, 0.45), (-0.26, 0.26), (z, z + 0.04)),
            Block(None, (-0.44, 0.44), (-0.25, 0.25), (z + 0.01, z + 0.04)),
        )
        for z in (0.2, 0.72)
    ]
    posts = [tube([(x, y, 0.1), (x, y, 0.78)], 0.014, "metal", 8) for x in (-0.44, 0.44) for y in (-0.25, 0.25)]
    wheels = [
        lying(cylinder(0.06, 0.03, "rubber", 16)).turned(yaw=90).moved(x, y, 0.06)
        for x in (-0.4, 0.4)
        for y in (-0.22, 0.22)
    ]
    bar = tube(
        [(-0.44, -0.25, 0.75), (-0.54, -0.25, 0.98), (-0.54, 0.25, 0.98), (-0.44, 0.25, 0.75)], 0.014, "metal", 8
    )
    load = [
        desktop.carton((0.34, 0.28, 0.24)).turned(yaw=10).moved(-0.18, 0, 0.732),
        desktop.carton((0.28, 0.3, 0.16)).turned(yaw=-14).moved(0.2, 0.02, 0.732),
        desktop.carton((0.5, 0.34, 0.3)).moved(0, 0, 0.212),
        desktop.book_stack(stream, 3).moved(0.2, 0.02, 0.893),
    ]
    return join([*decks, *posts, *wheels, bar, *load])
