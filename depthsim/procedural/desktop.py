"""What lies on desks and stands on shelves: monitors, keyboards, lamps, mugs, paper, books, boxes.

Each thing stands on z = 0 about the origin and faces -y.
"""

import numpy as np

from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Part, join, rotation
from depthsim.procedural.primitives import box, boxes, cushion, cylinder, revolve
from depthsim.procedural.sweep import tube


def monitor(width: float = 0.56) -> Part:
    """A flat screen on a stand; its glass is set back a little in the rim."""
    x, height, foot = width / 2, width * 0.6, 0.13
    panel = blocks(
        Block("plastic", (-x, x), (-0.02, 0.012), (foot, foot + height)),
        Block(None, (-x + 0.01, x - 0.01), (-0.02, -0.016), (foot + 0.018, foot + height - 0.01)),
        Block("glass", (-x + 0.01, x - 0.01), (-0.016, 0.0), (foot + 0.018, foot + height - 0.01)),
        Block("plastic", (-x * 0.6, x * 0.6), (0.012, 0.045), (foot + 0.06, foot + height - 0.08)),
    )
    stand = blocks(
        Block("plastic", (-0.12, 0.12), (-0.06, 0.12), (0.0, 0.012)),
        Block("plastic", (-0.035, 0.035), (0.05, 0.07), (0.012, foot + height * 0.55)),
    )
    return join([panel.turned(roll=-4).moved(z=0.01), stand])


def laptop() -> Part:
    """An open laptop."""
    keys = [(0.023, 0.02, 0.003) for _ in range(4) for _ in range(11)]
    places = [((column - 5) * 0.0275, -0.02 + row * 0.025, 0.0185) for row in range(4) for column in range(11)]
    lid = blocks(
        Block("metal", (-0.165, 0.165), (-0.005, 0.0), (0.0, 0.22)),
        Block("glass", (-0.157, 0.157), (-0.006, -0.003), (0.01, 0.212)),
    )
    return join(
        [
            box((0.33, 0.23, 0.017), "metal", (0, 0, 0.0085)),
            boxes(keys, places, "plastic"),
            lid.turned(roll=-18).moved(0, 0.112, 0.016),
        ]
    )


def keyboard() -> Part:
    """A full keyboard with its keys."""
    columns, rows = 15, 5
    keys = [(0.0235, 0.0215, 0.009)] * (columns * rows)
    places = [
        ((column - 7) * 0.0275 + 0.008 * (column > 10), (row - 2) * 0.026, 0.0215)
        for row in range(rows)
        for column in range(columns)
    ]
    return join([box((0.44, 0.15, 0.018), "plastic", (0, 0, 0.009)), boxes(keys, places, "plastic")]).turned(roll=3)


def mouse() -> Part:
    """A computer mouse."""
    return cushion((0.062, 0.105, 0.06), "plastic", 0.7, 14, 8).moved(z=0.01)


def mug() -> Part:
    """A mug with a handle."""
    profile = [(0.036, 0), (0.041, 0.004), (0.041, 0.095), (0.037, 0.095), (0.036, 0.008), (0, 0.008)]
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, 9)
    path = np.stack([0.038 + 0.028 * np.cos(angle), 0 * angle, 0.048 + 0.03 * np.sin(angle)], axis=1)
    return join([revolve(profile, 18, "ceramic"), tube(path, 0.005, "ceramic", 6)])


def desk_lamp(reach: float = 0.42) -> Part:
    """A jointed lamp with a conical shade that lights what lies in front of it."""
    elbow, head = np.array([0, 0.1, 0.4]), np.array([0, 0.1 - reach, 0.52])
    shade = revolve([(0.025, 0.0), (0.085, -0.11), (0.082, -0.11), (0.022, -0.003)][::-1], 22, "metal", closed=True)
    return join(
        [
            cylinder(0.09, 0.022, "metal", 24),
            tube(np.array([[0, 0, 0.02], elbow]), 0.008, "metal", 8),
            tube(np.array([elbow, head]), 0.008, "metal", 10),
            cylinder(0.016, 0.05, "plastic", 14).turned(roll=90).moved(0, 0.125, 0.4),
            shade.turned(roll=-24).moved(*head),
            cylinder(0.024, 0.04, "plastic", 18).turned(roll=-24).moved(head[0], head[1], head[2] - 0.02),
            revolve([(0, -0.075), (0.02, -0.07), (0.026, -0.055), (0.014, -0.02), (0, -0.01)], 14, "glass")
            .turned(roll=-24)
            .moved(*head),
        ]
    )


def papers(stream: Stream, sheets: int = 8) -> Part:
    """A loose stack of A4 sheets and folders."""
    thick = stream.uniform(0.0008, 0.004, sheets)
    z = np.cumsum(thick) - thick / 2
    places = np.stack([stream.uniform(-0.015, 0.015, sheets), stream.uniform(-0.015, 0.015, sheets), z], axis=1)
    sizes = np.stack([np.full(sheets, 0.21), np.full(sheets, 0.297), thick], axis=1)
    return boxes(sizes, places, "paper", rotation(yaw=stream.uniform(-9, 9, sheets)))


def pens(stream: Stream) -> Part:
    """A cup of pens."""
    cup = revolve([(0.035, 0), (0.038, 0.1), (0.035, 0.1), (0.033, 0.005), (0, 0.005)], 20, "metal")
    parts = [cup]
    for yaw in stream.uniform(0, 360, 6):
        lean = stream.number(6, 14)
        parts.append(
            cylinder(0.004, 0.15, "plastic", 6).turned(roll=lean).moved(0, 0.012, 0.008).turned(yaw=float(yaw))
        )
    return join(parts)


def phone() -> Part:
    """A desk telephone with its receiver and cord."""
    body = blocks(
        Block("plastic", (-0.1, 0.1), (-0.1, 0.1), (0.0, 0.035)),
        Block("glass", (-0.01, 0.08), (0.03, 0.085), (0.035, 0.038)),
    )
    places = [(0.005 + i * 0.026, -0.08 + j * 0.024, 0.037) for i in range(3) for j in range(4)]
    keys = boxes([(0.018, 0.014, 0.006)] * 12, places, "plastic")
    receiver = tube(
        [(-0.07, -0.1, 0.045), (-0.07, -0.07, 0.055), (-0.07, 0.07, 0.055), (-0.07, 0.1, 0.045)],
        [0.026, 0.018, 0.018, 0.026],
        "plastic",
        10,
    )
    return join([body, keys, receiver]).turned(roll=6).moved(z=0.012)


def book_row(stream: Stream, length: float, room: float) -> Part:
    """Books and binders side by side along x, from x = 0 to about ``length``, below the height ``room`` [m]."""
    parts: list[Part] = []
    x = stream.number(0.0, 0.03)
    while x < length - 0.09:
        if stream.number() < 0.25:
            parts.append(_binder(min(room - 0.03, 0.315)).moved(x + 0.036, 0.0))
            x += 0.075
            continue
        thick = min(stream.number(0.012, 0.05), length - x)
        height = min(stream.number(0.17, 0.31), room - 0.02)
        depth = stream.number(0.13, 0.22)
        parts.append(
            _book(stream, thick, depth, height).moved(x + thick / 2, (depth - 0.24) / 2 + stream.number(0, 0.015))
        )
        x += thick + 0.0015
        if stream.number() < 0.06:
            x += stream.number(0.05, 0.18)
    return join(parts) if parts else book_stack(stream)


def _book(stream: Stream, thick: float, depth: float, height: float) -> Part:
    cover = ("cardboard", "paper", "fabric", "plastic")[int(stream.number() ** 1.5 * 4)]
    return box((thick, depth, height), cover, (0, 0, height / 2))


def _binder(height: float) -> Part:
    body = blocks(
        Block("cardboard", (-0.035, 0.035), (-0.12, 0.16), (0, height)),
        Block(None, (-0.032, 0.032), (-0.117, 0.16), (0, height)),
        Block("paper", (-0.02, 0.02), (-0.1, 0.14), (0.005, height - 0.03)),
    )
    label = box((0.04, 0.002, height * 0.5), "paper", (0, -0.1205, height * 0.55))
    ring = cylinder(0.011, 0.004, "metal", 12).turned(roll=90).moved(0, -0.119, 0.055)
    return join([body, label, ring])


def book_stack(stream: Stream, count: int = 4) -> Part:
    """Books on top of one another."""
    parts, z = [], 0.0
    for _ in range(count):
        thick = stream.number(0.015, 0.045)
        book = _book(stream, thick, stream.number(0.14, 0.2), stream.number(0.2, 0.28)).turned(pitch=90)
        parts.append(book.moved(-0.12, 0, z + thick / 2).turned(yaw=stream.number(-25, 25)))
        z += thick
    return join(parts)


def carton(size: tuple[float, float, float] = (0.4, 0.3, 0.25)) -> Part:
    """A closed cardboard box with a strip of tape along its top."""
    x, y, z = size[0] / 2, size[1] / 2, size[2]
    return blocks(
        Block("cardboard", (-x, x), (-y, y), (0, z)),
        Block("plastic", (-x, x), (-0.025, 0.025), (z, z + 0.001)),
        Block(None, (-x, x), (-0.002, 0.002), (z - 0.002, z + 0.001)),
    )
