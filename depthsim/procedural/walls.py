"""Walls along the axes, and what is let into them or hangs on them: doors, windows, radiators, signs, lamps."""

from typing import NamedTuple

import numpy as np

from depthsim.procedural.blocks import Block, Range, blocks
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Part, join, rotation
from depthsim.procedural.primitives import box, boxes, cylinder, lying, revolve, torus
from depthsim.procedural.sweep import tube


class Wall(NamedTuple):
    """One wall of a room: the plane where coordinate ``axis`` (0 x, 1 y) is ``position``; the room lies inwards.

    ``outward`` is +1 where the wall's far side is towards larger coordinates, else -1.
    """

    axis: int
    position: float
    outward: int

    def block(self, tag: str | None, along: Range, depth: Range, z: Range) -> Block:
        """A block given along the wall, into it (negative: in the room) and upwards [m]."""
        near, far = sorted(self.position + self.outward * value for value in depth)
        return Block(tag, along, (near, far), z) if self.axis == 1 else Block(tag, (near, far), along, z)

    def mount(self, part: Part, along: float, z: float = 0.0, gap: float = 0.0) -> Part:
        """A part that faces -y with its back in y = 0, hung on the wall ``gap`` in front of it [m]."""
        at = self.position - self.outward * gap
        if self.axis == 1:
            return part.turned(yaw=0 if self.outward > 0 else 180).moved(along, at, z)
        return part.turned(yaw=-90 if self.outward > 0 else 90).moved(at, along, z)


def window(wall: Wall, along: Range, z: Range, panes: int = 2, tag: str = "wood") -> list[Block]:
    """A window set back in its wall: sill, frame with ``panes`` casements, glass."""
    a, b = along
    low, high = z
    items = [
        wall.block("glass", along, (0.12, 0.2), z),
        wall.block(None, along, (0.0, 0.12), z),
        wall.block(tag, (a - 0.05, b + 0.05), (-0.06, 0.12), (low - 0.03, low)),
        wall.block(tag, along, (0.06, 0.12), z),
    ]
    step = (b - a) / panes
    for pane in range(panes):
        left, right = a + pane * step, a + (pane + 1) * step
        items += [
            wall.block(None, (left + 0.045, right - 0.045), (0.06, 0.12), (low + 0.05, high - 0.05)),
            wall.block(tag, (left + 0.05, right - 0.05), (0.075, 0.12), (low + 0.055, high - 0.055)),
            wall.block(None, (left + 0.1, right - 0.1), (0.075, 0.12), (low + 0.105, high - 0.105)),
        ]
    return items


def door(wall: Wall, middle: float, width: float = 0.9, height: float = 2.05, glazed: bool = False) -> list[Block]:
    """A door with its frame, two set-back panels (or a glazed strip) and a kick plate; the lever comes apart."""
    a, b = middle - width / 2, middle + width / 2
    items = [
        wall.block("wood", (a - 0.08, b + 0.08), (-0.015, 0.05), (0.0, height + 0.08)),
        wall.block(None, (a, b), (-0.015, 0.05), (0.0, height)),
        wall.block("wood", (a, b), (0.05, 0.1), (0.0, height)),
        wall.block("metal", (a + 0.03, b - 0.03), (0.048, 0.05), (0.02, 0.2)),
    ]
    if glazed:
        pane = (b - 0.32, b - 0.14)
        items += [
            wall.block(None, pane, (0.05, 0.065), (0.6, height - 0.2)),
            wall.block("glass", pane, (0.065, 0.1), (0.6, height - 0.2)),
        ]
    else:
        for z in ((0.3, 0.9), (1.1, height - 0.15)):
            items.append(wall.block(None, (a + 0.13, b - 0.13), (0.05, 0.06), z))
            items.append(wall.block("wood", (a + 0.17, b - 0.17), (0.053, 0.06), (z[0] + 0.04, z[1] - 0.04)))
    return items


def lever() -> Part:
    """A door lever with its plate, back in y = 0; the lever points to +x."""
    path = [(0, 0.0, 0), (0, -0.045, 0), (0.012, -0.055, 0), (0.12, -0.055, 0)]
    return join([box((0.04, 0.012, 0.2), "metal", (0, -0.004, -0.03)), tube(path, 0.01, "metal", 10)])


def radiator(width: float = 1.2, height: float = 0.55) -> Part:
    """A panel radiator with its ribs, valve and pipes; it stands 4 cm off its wall and its foot is at z = 0."""
    count = int(width / 0.04)
    x = (np.arange(count) - (count - 1) / 2) * 0.04
    ribs = boxes([(0.024, 0.02, height - 0.06)] * count, np.stack([x, x * 0 - 0.105, x * 0 + height / 2], 1), "metal")
    panels = [box((width, 0.012, height), "metal", (0, y, height / 2)) for y in (-0.095, -0.045)]
    top = boxes([(0.004, 0.04, 0.01)] * count, np.stack([x, x * 0 - 0.07, x * 0 + height + 0.002], 1), "metal")
    pipes = [
        tube([(s, -0.07, 0.04), (s, -0.07, -0.2)], 0.009, "metal", 8) for s in (-width / 2 + 0.05, width / 2 - 0.05)
    ]
    valve = lying(cylinder(0.02, 0.06, "plastic", 12)).moved(width / 2, -0.07, height - 0.08)
    return join([*panels, ribs, top, *pipes, valve])


def blind(width: float, drop: float, stream: Stream) -> Part:
    """A venetian blind let down by ``drop`` [m]; its head rail hangs at z = 0 with its back in y = 0."""
    count = int(drop / 0.032)
    z = -0.05 - np.arange(count) * 0.032
    tilt = 28 + stream.uniform(-2, 2, count)
    places = np.stack([z * 0, z * 0 - 0.03, z], axis=1)
    slats = boxes([(width, 0.03, 0.0012)] * count, places, "metal", rotation(roll=tilt))
    rails = boxes([(width, 0.04, 0.04), (width, 0.03, 0.02)], [(0, -0.03, -0.02), (0, -0.03, z[-1] - 0.03)], "metal")
    cords = boxes([(0.002, 0.002, drop)] * 2, [(s * width * 0.35, -0.03, -drop / 2) for s in (-1, 1)], "fabric")
    return join([slats, rails, cords])


def ceiling_lamp(length: float = 1.2, width: float = 0.3) -> Part:
    """A lamp whose back lies in z = 0: housing, louvre, a diffuser a little behind its rim."""
    x, y = length / 2, width / 2
    body = blocks(
        Block("metal", (-x, x), (-y, y), (-0.06, 0.01)),
        Block(None, (-x + 0.015, x - 0.015), (-y + 0.015, y - 0.015), (-0.06, -0.03)),
        Block("plastic", (-x + 0.015, x - 0.015), (-y + 0.015, y - 0.015), (-0.04, -0.02)),
    )
    count = int(length / 0.1)
    louvre = (np.arange(1, count) / count - 0.5) * (length - 0.03)
    places = np.stack([louvre, louvre * 0, louvre * 0 - 0.048], axis=1)
    return join([body, boxes([(0.003, width - 0.03, 0.016)] * len(places), places, "metal")])


def notice_board(width: float, height: float, stream: Stream, sheets: int = 7) -> Part:
    """A pin board with sheets on it, back in y = 0, foot at z = 0."""
    x = width / 2
    board = blocks(
        Block("wood", (-x, x), (-0.02, 0.0), (0, height)),
        Block("fabric", (-x + 0.025, x - 0.025), (-0.016, 0.0), (0.025, height - 0.025)),
        Block(None, (-x + 0.025, x - 0.025), (-0.02, -0.016), (0.025, height - 0.025)),
    )
    column = (np.arange(sheets) + 0.5) / sheets * (width - 0.1) - x + 0.05
    places = np.stack(
        [column, np.full(sheets, -0.018) - np.arange(sheets) * 2e-4, stream.uniform(0.25, 0.75, sheets) * height], 1
    )
    turns = rotation(pitch=stream.uniform(-6, 6, sheets))
    return join(
        [board, boxes([(min(0.21, width / 4), 0.003, min(0.29, height / 2.5))] * sheets, places, "paper", turns)]
    )


def whiteboard(width: float = 1.8, height: float = 1.0) -> Part:
    """A whiteboard with an aluminium edge and a tray of pens, back in y = 0, foot at z = 0."""
    x = width / 2
    board = blocks(
        Block("metal", (-x, x), (-0.025, 0.0), (0, height)),
        Block(None, (-x + 0.02, x - 0.02), (-0.025, -0.018), (0.02, height - 0.02)),
        Block("paint", (-x + 0.02, x - 0.02), (-0.018, 0.0), (0.02, height - 0.02)),
        Block("metal", (-0.3, 0.3), (-0.09, 0.0), (-0.015, 0.0)),
    )
    pens = [lying(cylinder(0.009, 0.13, "plastic", 8)).moved(-0.25 + 0.16 * i, -0.06, 0.009) for i in range(3)]
    return join([board, *pens])


def extinguisher() -> Part:
    """A fire extinguisher on its bracket, back in y = 0, foot at z = 0."""
    body = revolve([(0.07, 0), (0.075, 0.01), (0.075, 0.42), (0.025, 0.48)], 24, "paint")
    hose = [(0.03, 0, 0.52), (0.1, 0, 0.5), (0.115, 0, 0.35), (0.1, 0.01, 0.15)]
    head = [box((0.03, 0.12, 0.02), "metal", (0, -0.03, 0.54)), cylinder(0.02, 0.06, "metal", 12).moved(z=0.475)]
    straps = [torus(0.076, 0.004, "metal", 24, 6).moved(z=z) for z in (0.12, 0.34)]
    bottle = join([body, *head, *straps, tube(hose, 0.011, "rubber", 8)]).moved(0, -0.1)
    return join([bottle, box((0.06, 0.03, 0.4), "metal", (0, -0.012, 0.24))])


def sign(width: float = 0.32, height: float = 0.16, tag: str = "plastic") -> Part:
    """A thin sign, back in y = 0, about z = 0."""
    return box((width, 0.012, height), tag, (0, -0.005, 0))


def switch() -> Part:
    """A light switch or a socket, back in y = 0, about z = 0."""
    return join(
        [box((0.08, 0.012, 0.08), "plastic", (0, -0.004, 0)), box((0.05, 0.012, 0.05), "plastic", (0, -0.009, 0))]
    )
