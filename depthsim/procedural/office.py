"""An open-plan office of 10 m by 7.5 m."""

import numpy as np

from depthsim.procedural import desktop, furniture, plants, walls
from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Part, join
from depthsim.procedural.primitives import boxes, cylinder
from depthsim.procedural.walls import Wall

LENGTH, WIDTH, HEIGHT = 10.0, 7.5, 2.8
WEST, EAST, SOUTH, NORTH = Wall(0, 0.0, -1), Wall(0, LENGTH, 1), Wall(1, 0.0, -1), Wall(1, WIDTH, 1)
WINDOWS = ((0.7, 2.9), (3.9, 6.1), (7.1, 9.3))


def office(seed: int = 1, door: str = "closed") -> Part:
    """An office with two islands of four desks, shelves, a meeting corner, windows and a door.

    The floor is z = 0; the room reaches from x = 0 to 10 m and y = 0 to 7.5 m, its ceiling is at 2.8 m.
    ``seed`` changes what lies about, not where the furniture stands. ``door``: ``closed``, or ``open``: without its
    leaf, hinged at (8.45, -0.05), and with a lobby behind it.
    """
    if door not in ("closed", "open"):
        raise ValueError(f"office: door is {door!r}; give closed or open")
    stream = Stream(seed, 101)
    return join(
        [
            _shell(door == "open"),
            _ceiling(),
            *_on_walls(stream, door == "open"),
            _island(stream).moved(2.9, 4.7),
            _island(stream).moved(7.1, 4.7),
            *_shelves(stream),
            *_meeting_corner(stream),
            plants.palm(stream, 1.7).moved(0.75, 6.75),
            plants.bush(stream, 1.3).moved(5.0, 6.75),
            plants.palm(stream, 1.3).moved(9.35, 6.85),
            furniture.coat_stand(stream).moved(9.5, 1.2),
            furniture.waste_bin(0.2, 0.6, "metal").moved(9.6, 2.3),
            desktop.carton((0.5, 0.38, 0.35)).turned(yaw=12).moved(0.5, 3.2),
            desktop.carton((0.36, 0.3, 0.22)).turned(yaw=-20).moved(0.48, 3.2, 0.352),
        ]
    )


def _shell(is_open: bool) -> Part:
    items = [
        Block("carpet", (-0.5, LENGTH + 0.5), (-0.5, WIDTH + 0.5), (-0.3, 0.0)),
        Block("formboard", (-0.5, LENGTH + 0.5), (-0.5, WIDTH + 0.5), (HEIGHT, HEIGHT + 0.3)),
        Block(None, (0, LENGTH), (0, WIDTH), (0, HEIGHT)),
    ]
    # Skirting boards, then the pillars between the windows, then the openings.
    for wall, end in ((WEST, WIDTH), (EAST, WIDTH), (SOUTH, LENGTH), (NORTH, LENGTH)):
        items.append(wall.block("wood", (0, end), (-0.012, 0), (0, 0.07)))
    for x in (3.4, 6.6):
        items.append(NORTH.block("plaster", (x - 0.2, x + 0.2), (-0.18, 0), (0, HEIGHT)))
    for along in WINDOWS:
        items += walls.window(NORTH, along, (0.85, 2.35))
    items += walls.door(SOUTH, 8.9)
    if is_open:
        items.append(SOUTH.block(None, (8.45, 9.35), (0.048, 1.5), (0.0, 2.05)))
    return blocks(*items, around="plaster")


def _ceiling() -> Part:
    """The bars between the ceiling's boards, the lamps, an air outlet, smoke detectors."""
    x, y = np.arange(0.2, LENGTH, 0.6), np.arange(0.15, WIDTH, 0.6)
    along_y = boxes(
        [(0.024, WIDTH, 0.02)] * len(x), np.stack([x, x * 0 + WIDTH / 2, x * 0 + HEIGHT - 0.002], 1), "metal"
    )
    along_x = boxes(
        [(LENGTH, 0.024, 0.018)] * len(y), np.stack([y * 0 + LENGTH / 2, y, y * 0 + HEIGHT - 0.002], 1), "metal"
    )
    lamps = [walls.ceiling_lamp(1.176, 0.56).moved(a, b, HEIGHT) for a in (1.7, 4.7, 8.3) for b in (1.65, 4.65)]
    vent = boxes([(0.5, 0.012, 0.03)] * 14, [(6.5, 2.05 + 0.035 * i, HEIGHT - 0.01) for i in range(14)], "metal")
    alarms = [cylinder(0.055, 0.05, "plastic", 20).moved(a, 3.0, HEIGHT - 0.04) for a in (2.6, 7.4)]
    return join([along_y, along_x, *lamps, vent, *alarms])


def _on_walls(stream: Stream, is_open: bool) -> list[Part]:
    parts = [
        *([] if is_open else [SOUTH.mount(walls.lever(), 8.53, 1.05, -0.05)]),
        SOUTH.mount(walls.switch(), 8.2, 1.15),
        SOUTH.mount(furniture.clock(), 6.9, 2.2),
        SOUTH.mount(walls.whiteboard(2.2, 1.1), 6.6, 0.9),
        EAST.mount(walls.notice_board(1.5, 0.9, stream), 3.6, 1.2),
        EAST.mount(walls.extinguisher(), 0.5, 0.5),
        WEST.mount(walls.sign(0.9, 0.6, "paper"), 4.7, 1.6),
        WEST.mount(walls.sign(0.5, 0.7, "glass"), 5.9, 1.6),
    ]
    for (low, high), drop in zip(WINDOWS, (0.55, 1.2, 0.3), strict=True):
        parts.append(NORTH.mount(walls.radiator(high - low - 0.4), (low + high) / 2, 0.18, 0.03))
        parts.append(NORTH.mount(walls.blind(high - low - 0.04, drop, stream), (low + high) / 2, 2.35, -0.06))
    parts += [EAST.mount(walls.switch(), y, 0.3) for y in (1.8, 4.2, 5.0)]
    return parts


def _island(stream: Stream) -> Part:
    """Four desks, two and two face to face, about the origin, with chairs and all that lies on them."""
    parts = [furniture.screen_divider(1.56).moved(s * 0.8, 0, 0.74) for s in (-1, 1)]
    for x in (-0.8, 0.8):
        for yaw in (0, 180):
            parts.append(_workplace(stream).moved(0, -0.42).turned(yaw=yaw).moved(x))
    return join(parts)


def _workplace(stream: Stream) -> Part:
    """One desk about the origin, its chair in front of it (towards -y)."""
    top, jitter = 0.7305, stream.number
    parts = [furniture.desk(drawers=jitter() < 0.6)]
    two_screens = jitter() < 0.55
    if two_screens:
        parts += [
            desktop.monitor(0.54).turned(yaw=jitter(4, 12)).moved(-0.3, 0.2, top),
            desktop.monitor(0.54).turned(yaw=jitter(-12, -4)).moved(0.29, 0.2, top),
        ]
    else:
        parts += [
            desktop.monitor(0.61).turned(yaw=jitter(-6, 6)).moved(0.05, 0.2, top),
            desktop.laptop().turned(yaw=jitter(10, 30)).moved(-0.52, 0.02, top),
        ]
    parts += [
        desktop.keyboard().turned(yaw=jitter(-5, 5)).moved(0.0, -0.17, top + 0.004),
        desktop.mouse().turned(yaw=jitter(-15, 15)).moved(0.32, -0.17, top + 0.02),
        desktop.mug().turned(yaw=jitter(0, 360)).moved(jitter(-0.5, -0.38), -0.2, top),
        desktop.papers(stream).turned(yaw=jitter(-20, 20)).moved(0.58, -0.16, top),
    ]
    # Beside a laptop there is no room for the books.
    extras = [desktop.desk_lamp(), desktop.phone(), desktop.pens(stream), desktop.book_stack(stream)]
    places = [(0.7, 0.25), (-0.68, -0.2), (0.66, 0.1), (-0.66, 0.24)]
    for thing, (x, y) in list(zip(extras, places, strict=True))[: 4 if two_screens else 3]:
        if jitter() < 0.7:
            parts.append(thing.turned(yaw=jitter(-15, 15)).moved(x, y, top))
    chair = furniture.office_chair().turned(yaw=180 + jitter(-50, 50)).moved(jitter(-0.2, 0.1), jitter(-0.72, -0.55))
    if jitter() < 0.5:
        parts.append(furniture.waste_bin().moved(0.1, 0.15))
    return join([*parts, chair])


def _shelves(stream: Stream) -> list[Part]:
    """Shelves along the south wall and cabinets along the west wall."""
    parts = []
    for x in (3.35, 4.27, 5.19):
        parts.append(_filled_shelf(stream).turned(yaw=180).moved(x, 0.19))
    for y in (4.3, 5.11, 5.92):
        parts.append(furniture.cabinet().turned(yaw=90).moved(0.23, y))
    parts += [
        desktop.carton((0.38, 0.3, 0.26)).turned(yaw=80).moved(0.24, 4.3, 1.1),
        desktop.book_stack(stream, 5).turned(yaw=70).moved(0.24, 5.1, 1.1),
        plants.bush(stream, 0.5, 90, (0.1, 0.16)).moved(0.22, 5.95, 1.1),
    ]
    return parts


def _filled_shelf(stream: Stream) -> Part:
    parts = [furniture.shelf()]
    levels = furniture.shelf_levels()
    for level in levels:
        if stream.number() < 0.22:
            parts.append(desktop.carton((0.34, 0.24, 0.22)).turned(yaw=stream.number(-8, 8)).moved(-0.2, 0, level))
            parts.append(desktop.book_stack(stream, 3).moved(0.22, 0, level))
        else:
            length = stream.number(0.5, 0.84)
            parts.append(desktop.book_row(stream, length, 0.36).moved(-0.42, 0.0, level))
    parts.append(
        desktop.carton((0.4, 0.3, 0.25)).turned(yaw=stream.number(-10, 10)).moved(stream.number(-0.2, 0.2), 0, 2.0)
    )
    return join(parts)


def _meeting_corner(stream: Stream) -> list[Part]:
    """A round table with chairs in the south-west corner, and a sofa."""
    parts = [furniture.round_table(0.55), desktop.laptop().turned(yaw=160).moved(0.1, 0.2, 0.7405)]
    parts += [
        desktop.mug().moved(-0.3, -0.1, 0.7405),
        desktop.papers(stream, 4).turned(yaw=40).moved(-0.15, 0.25, 0.7405),
    ]
    for yaw in (20, 110, 200, 290):
        turn = yaw + stream.number(-15, 15)
        parts.append(furniture.side_chair().moved(0, 0.72).turned(yaw=turn))
    return [join(parts).moved(1.45, 1.3)]
