"""A steel hall: corrugated walls, columns, roof trusses, lamps, windows, a roller door, and fittings for it."""

import numpy as np

from depthsim.procedural import walls
from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.part import Floats, Part, copies, join, rotation
from depthsim.procedural.primitives import box, boxes, cone, cylinder
from depthsim.procedural.sweep import SQUARE, sweep
from depthsim.procedural.walls import Wall

LENGTH, WIDTH, HEIGHT = 40.0, 24.0, 8.0
EAVES = 6.4
WEST, EAST, SOUTH, NORTH = Wall(0, 0.0, -1), Wall(0, LENGTH, 1), Wall(1, 0.0, -1), Wall(1, WIDTH, 1)
BAYS = np.arange(0.25, LENGTH, 6.58)


def hall() -> list[Part]:
    """A hall of 40 m (x) by 24 m (y) and 8 m: the floor is z = 0, a corner the origin; closed all round."""
    return [_shell(), *_cladding(), *_frames(), *_roof()]


def _shell() -> Part:
    items = [
        Block("cement", (-1, LENGTH + 1), (-1, WIDTH + 1), (-0.5, 0.0)),
        Block("cement", (-1, LENGTH + 1), (-1, WIDTH + 1), (0.0, 1.1)),
        Block(None, (0, LENGTH), (0, WIDTH), (0.0, HEIGHT)),
    ]
    # The plinth stands out from the cladding above it.
    for wall, end in ((WEST, WIDTH), (EAST, WIDTH), (SOUTH, LENGTH), (NORTH, LENGTH)):
        items.append(wall.block("cement", (0, end), (-0.12, 0), (0, 1.1)))
    for wall in (SOUTH, NORTH):
        for low in np.arange(1.0, LENGTH - 5, 6.58):
            items += walls.window(wall, (float(low), float(low) + 5.0), (4.0, 5.6), panes=4, tag="metal")
    items += [
        EAST.block(None, (9.5, 14.5), (-0.12, 0.3), (0, 4.5)),
        EAST.block("metal", (9.5, 14.5), (0.3, 0.5), (0, 4.5)),
        *walls.door(Wall(0, LENGTH - 0.12, 1), 17.5, 1.0, 2.1),
        *walls.door(Wall(0, 0.12, -1), 4.0, 1.0, 2.1),
    ]
    return blocks(*items, around="metal")


def _cladding() -> list[Part]:
    """The ribs of the corrugated walls, left out at windows and doors, and the slats of the roller door."""
    parts = []
    x = np.arange(0.5, LENGTH, 0.5)
    clear = ((x - 1.0) % 6.58 > 5.1) | (x > LENGTH - 1.9)
    for side in (0.0, WIDTH):
        for low, high, where in ((1.1, 3.95, x), (3.95, 5.65, x[clear]), (5.65, HEIGHT, x)):
            centers = np.stack([where, where * 0 + side, where * 0 + (low + high) / 2], axis=1)
            parts.append(boxes([(0.16, 0.09, high - low - 0.002)] * len(where), centers, "metal"))
    y = np.arange(0.5, WIDTH, 0.5)
    for at in (0.0, LENGTH):
        foot = np.full(len(y), 1.1)
        if at:
            foot[(y > 9.2) & (y < 14.8)] = 4.6
        foot[np.abs(y - (17.5 if at else 4.0)) < 0.75] = 2.3
        centers = np.stack([y * 0 + at, y, (foot + HEIGHT) / 2], axis=1)
        parts.append(boxes(np.stack([y * 0 + 0.09, y * 0 + 0.16, HEIGHT - foot], axis=1), centers, "metal"))
    z = np.arange(0.06, 4.5, 0.12)
    slats = np.stack([z * 0 + LENGTH + 0.3, z * 0 + 12.0, z], axis=1)
    return [*parts, boxes([(0.05, 4.98, 0.09)] * len(z), slats, "metal", rotation(pitch=12))]


def beam(start: Floats, end: Floats, width: float, height: float) -> Part:
    """A box-section member from one point to another [m]."""
    return sweep(np.stack([start, end]), 1.0, SQUARE * (width / 2, height / 2), "metal")


def _frames() -> list[Part]:
    """Columns of H section along both long walls and a roof truss on each pair."""
    column = blocks(
        Block("metal", (-0.15, 0.15), (-0.16, -0.14), (0, EAVES)),
        Block("metal", (-0.15, 0.15), (0.14, 0.16), (0, EAVES)),
        Block("metal", (-0.008, 0.008), (-0.14, 0.14), (0, EAVES)),
        Block("metal", (-0.22, 0.22), (-0.22, 0.22), (0, 0.025)),
    )
    columns = copies(column, [(x, y, 0) for x in BAYS for y in (0.35, WIDTH - 0.35)])
    nodes = np.linspace(0.3, WIDTH - 0.3, 17)
    top = EAVES + 1.35 - 0.5 * np.abs(nodes - WIDTH / 2) / (WIDTH / 2)
    upper, lower = np.stack([nodes * 0, nodes, top], 1), np.stack([nodes * 0, nodes, nodes * 0 + EAVES], 1)
    members = [
        beam(upper[0], upper[8], 0.14, 0.14),
        beam(upper[8], upper[-1], 0.14, 0.14),
        beam(lower[0], lower[-1], 0.14, 0.14),
    ]
    members += [beam(lower[i], upper[i], 0.07, 0.07) for i in range(17)]
    members += [beam(lower[i], upper[i + 1], 0.06, 0.06) for i in range(8)]
    members += [beam(lower[i], upper[i - 1], 0.06, 0.06) for i in range(9, 17)]
    return [columns, copies(join(members), [(x, 0, 0) for x in BAYS])]


def _roof() -> list[Part]:
    """Purlins, roof lights, air ducts and bell lamps."""
    y = np.linspace(1.2, WIDTH - 1.2, 12)
    purlins = boxes([(LENGTH, 0.07, 0.16)] * 12, np.stack([y * 0 + LENGTH / 2, y, y * 0 + HEIGHT - 0.07], 1), "metal")
    lights = boxes(
        [(4.6, 1.4, 0.08)] * 10,
        [(x, y, HEIGHT - 0.01) for x in np.arange(3.6, LENGTH - 8, 6.58) for y in (6.8, 17.2)],
        "glass",
    )
    bell = join(
        [
            cone(0.3, 0.08, 0.28, "metal", 24),
            cylinder(0.08, 0.2, "metal", 16).moved(z=0.27),
            cylinder(0.27, 0.012, "glass", 24).moved(z=-0.006),
            box((0.012, 0.012, 1.0), "metal", (0, 0, 0.95)),
        ]
    )
    lamps = copies(bell, [(x, y, EAVES + 0.05) for x in np.arange(3.5, LENGTH, 6.58) for y in (4.5, 12.0, 19.5)])
    duct = cylinder(0.35, LENGTH - 2, "metal", 28).turned(pitch=90).moved(1.0, 2.4, EAVES - 0.4)
    outlets = boxes([(0.7, 0.3, 0.3)] * 8, [(x, 2.4, EAVES - 0.78) for x in np.linspace(4, LENGTH - 4, 8)], "metal")
    return [purlins, lights, lamps, duct, outlets]
