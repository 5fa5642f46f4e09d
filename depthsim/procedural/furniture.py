"""Office furniture: desks, chairs, shelves, cabinets, tables.

Each piece stands on z = 0 about the origin; its front, where a person sits or stands, faces -y.
"""

import numpy as np

from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Floats, Part, copies, join, rotation, spin
from depthsim.procedural.primitives import box, boxes, cone, cushion, cylinder, lying, revolve, sphere, torus
from depthsim.procedural.sweep import tube


def desk(width: float = 1.6, depth: float = 0.8, drawers: bool = True) -> Part:
    """A desk with a steel frame, a cable tray, and a set of drawers on its right."""
    x, y = width / 2, depth / 2
    frame = [Block("metal", (-x + 0.1, x - 0.1), (-0.03, 0.03), (0.66, 0.705))]
    for side in (-1, 1):
        inner, outer = sorted((side * (x - 0.12), side * (x - 0.06)))
        frame += [
            Block("metal", (inner, outer), (-y + 0.06, y - 0.06), (0.0, 0.04)),
            Block("metal", (inner, outer), (-0.05, 0.05), (0.04, 0.705)),
            Block("metal", (inner, outer), (-y + 0.1, y - 0.1), (0.675, 0.705)),
        ]
    parts = [
        blocks(*frame),
        blocks(
            Block("wood", (-x, x), (-y, y), (0.705, 0.73)),
            Block(None, (-0.06, 0.06), (y - 0.1, y - 0.05), (0.705, 0.73)),
        ),
        blocks(
            Block("metal", (-x + 0.3, x - 0.3), (y - 0.22, y - 0.08), (0.58, 0.66)),
            Block(None, (-x + 0.303, x - 0.303), (y - 0.217, y - 0.083), (0.583, 0.66)),
        ),
    ]
    if drawers:
        parts.append(pedestal().moved(x - 0.36, -0.08))
    return join(parts)


def pedestal() -> Part:
    """A chest of three drawers on castors, to go under a desk."""
    items = [Block("metal", (-0.21, 0.21), (-0.27, 0.27), (0.06, 0.58))]
    for low, high in ((0.075, 0.31), (0.32, 0.44), (0.45, 0.57)):
        items += [
            Block("metal", (-0.2, 0.2), (-0.285, -0.27), (low, high)),
            Block(None, (-0.07, 0.07), (-0.285, -0.272), (high - 0.03, high - 0.01)),
        ]
    wheels = copies(
        lying(cylinder(0.028, 0.03, "rubber", 8)), [[a, b, 0.028] for a in (-0.18, 0.15) for b in (-0.2, 0.2)]
    )
    stems = boxes([(0.02, 0.02, 0.03)] * 4, [[a, b, 0.05] for a in (-0.165, 0.165) for b in (-0.2, 0.2)], "metal")
    return join([blocks(*items), wheels, stems])


def office_chair() -> Part:
    """A swivel chair with five castors, arm rests and a curved back."""
    arm_angle = np.arange(5) * 72.0
    leg = tube([(0.03, 0, 0.1), (0.16, 0, 0.1), (0.31, 0, 0.075)], [0.03, 0.024, 0.016], "plastic", 6)
    castor = join(
        [
            lying(cylinder(0.03, 0.036, "rubber", 10)).turned(yaw=90).moved(0.3, -0.018, 0.03),
            cylinder(0.012, 0.06, "metal", 6).moved(0.3, 0, 0.03),
        ]
    )
    parts = [
        copies(join([leg, castor]), np.zeros((5, 3)), spin(arm_angle)),
        cone(0.05, 0.035, 0.12, "plastic", 14).moved(z=0.07),
        cylinder(0.025, 0.24, "metal", 14).moved(z=0.18),
        box((0.3, 0.24, 0.03), "plastic", (0, 0, 0.42)),
        cushion((0.5, 0.48, 0.09), "fabric", 0.4, 20, 8).moved(z=0.475),
        _bent(cushion((0.46, 0.07, 0.58), "fabric", 0.4, 20, 10)).turned(roll=-8).moved(0, -0.27, 0.86),
        tube([(0, -0.06, 0.42), (0, -0.24, 0.43), (0, -0.31, 0.5), (0, -0.335, 0.85)], 0.022, "metal", 8),
    ]
    for side in (-1, 1):
        post = [(side * 0.18, 0, 0.43), (side * 0.28, 0, 0.45), (side * 0.29, 0, 0.55), (side * 0.29, 0.02, 0.66)]
        parts += [
            tube(post, 0.016, "metal", 8),
            cushion((0.07, 0.27, 0.035), "rubber", 0.5, 12, 6).moved(side * 0.29, 0.02, 0.675),
        ]
    # Built looking along +y; a chair's front is at -y like that of everything else.
    return join(parts).turned(yaw=180)


def _bent(back: Part) -> Part:
    """The back rest wrapped a little round the sitter and leaning back at its top."""
    x, y, z = back.vertices.T
    return Part(
        np.stack([x, y + 1.1 * x * x - 0.25 * np.clip(z, 0, None) ** 2, z], axis=1),
        back.faces, back.face_tags, back.tags,
    )  # fmt: skip


def side_chair() -> Part:
    """A stacking chair: a bent tube frame with a wooden seat and back."""
    parts: list[Part] = []
    for side in (-0.2, 0.2):
        leg = [(side, -0.24, 0.0), (side, -0.22, 0.42), (side, -0.2, 0.445), (side, 0.12, 0.445), (side, 0.18, 0.46)]
        parts += [
            tube([*leg, (side, 0.25, 0.84)], 0.011, "metal", 8),
            tube([(side, 0.1, 0.445), (side, 0.26, 0.0)], 0.011, "metal", 8),
        ]
    parts += [
        cushion((0.42, 0.44, 0.022), "wood", 0.3, 20, 6).moved(0, -0.02, 0.465),
        cushion((0.42, 0.02, 0.24), "wood", 0.3, 20, 6).turned(roll=-10).moved(0, 0.222, 0.74),
    ]
    return join(parts)


def shelf(width: float = 0.9, height: float = 2.0, depth: float = 0.34, levels: int = 5) -> Part:
    """An open shelf with a back; `shelf_levels` says where its boards are."""
    x, y, board = width / 2, depth / 2, 0.022
    items = [
        Block("wood", (-x, x), (-y, y), (0.0, height)),
        Block(None, (-x + board, x - board), (-y, y - 0.008), (0.08, height - board)),
    ]
    for level in shelf_levels(height, levels)[1:]:
        items.append(Block("wood", (-x + board, x - board), (-y + 0.01, y - 0.008), (level - board, level)))
    return blocks(*items)


def shelf_levels(height: float = 2.0, levels: int = 5) -> Floats:
    """The heights of the boards of `shelf` that things stand on [m]."""
    return np.linspace(0.08, height - 0.022, levels + 1)[:-1]


def cabinet(width: float = 0.8, height: float = 1.1, depth: float = 0.42) -> Part:
    """A steel cabinet with two doors, a plinth and bar handles."""
    x, y = width / 2, depth / 2
    body = blocks(
        Block("metal", (-x, x), (-y, y), (0.05, height)),
        Block("metal", (-x + 0.02, x - 0.02), (-y + 0.03, y), (0.0, 0.05)),
        Block("metal", (-x + 0.01, -0.003), (-y - 0.018, -y), (0.06, height - 0.01)),
        Block("metal", (0.003, x - 0.01), (-y - 0.018, -y), (0.06, height - 0.01)),
    )
    handles = [handle(0.16).moved(side * 0.05, -y - 0.018, height * 0.62) for side in (-1, 1)]
    return join([body, *handles])


def handle(length: float) -> Part:
    """An upright bar handle whose feet stand on the plane y = 0 and reach towards -y."""
    half = length / 2
    path = [
        (0, 0.005, -half),
        (0, -0.025, -half),
        (0, -0.033, -half + 0.01),
        (0, -0.033, half - 0.01),
        (0, -0.025, half),
    ]
    return tube([*path, (0, 0.005, half)], 0.006, "metal", 8)


def round_table(radius: float = 0.5) -> Part:
    """A round table on one leg with a foot plate."""
    return join(
        [
            cylinder(radius, 0.028, "wood", 48).moved(z=0.712),
            cylinder(0.035, 0.68, "metal", 18).moved(z=0.033),
            cone(0.27, 0.05, 0.035, "metal", 36),
        ]
    )


def screen_divider(width: float = 1.6, height: float = 0.45) -> Part:
    """A fabric screen with an aluminium edge, to stand on the joint of two desks; its foot is at z = 0."""
    x = width / 2
    return blocks(
        Block("metal", (-x, x), (-0.018, 0.018), (0.0, height)),
        Block("fabric", (-x + 0.02, x - 0.02), (-0.022, 0.022), (0.02, height - 0.02)),
    )


def waste_bin(radius: float = 0.15, height: float = 0.32, tag: str = "plastic") -> Part:
    """An open bin, wider at the top."""
    r, wall = radius, 0.004
    profile = [(r * 0.78, 0), (r, height), (r - wall, height), (r * 0.78 - wall, 0.006), (0, 0.006)]
    return revolve(profile, 28, tag)


def coat_stand(stream: Stream) -> Part:
    """A stand with hooks and a coat on it."""
    hook = tube([(0, 0, 1.66), (0.08, 0, 1.62), (0.14, 0, 1.66), (0.16, 0, 1.74)], 0.009, "wood", 8)
    foot = tube([(0, 0, 0.12), (0.15, 0, 0.1), (0.3, 0, 0.015)], 0.015, "wood", 8)
    coat = cushion((0.42, 0.2, 0.95), "fabric", 0.6, 28, 16)
    x, y, z = coat.vertices.T
    angle = np.arctan2(y, x)
    folds = 1 + 0.12 * np.sin(7 * angle + 3 * z) * np.clip(0.4 - z, 0, 1)
    shape = np.stack([x * folds * (1 - 0.35 * np.clip(z, 0, 1)), y * folds, z], axis=1)
    return join(
        [
            cylinder(0.018, 1.78, "wood", 12).moved(z=0.02),
            sphere(0.03, "wood", 12, 8).moved(z=1.81),
            copies(hook, np.zeros((4, 3)), spin(np.arange(4) * 90.0 + stream.number(0, 90))),
            copies(foot, np.zeros((4, 3)), spin(np.arange(4) * 90.0)),
            Part(shape, coat.faces, coat.face_tags, coat.tags).moved(0.2, 0.02, 1.14),
        ]
    )


def sofa(width: float = 1.6) -> Part:
    """A low sofa of cushions on a frame with short legs."""
    x = width / 2
    seats = [
        cushion((x - 0.16, 0.6, 0.18), "fabric", 0.25, 28, 10).moved(s * (x - 0.16) / 2, -0.08, 0.36) for s in (-1, 1)
    ]
    backs = [
        cushion((x - 0.16, 0.18, 0.42), "fabric", 0.3, 28, 10).turned(roll=-12).moved(s * (x - 0.16) / 2, 0.25, 0.6)
        for s in (-1, 1)
    ]
    arms = [cushion((0.16, 0.78, 0.5), "fabric", 0.2, 28, 10).moved(s * (x - 0.08), 0, 0.37) for s in (-1, 1)]
    legs = copies(cone(0.015, 0.022, 0.15, "wood", 10), [[a * (x - 0.1), b, 0] for a in (-1, 1) for b in (-0.32, 0.32)])
    return join([box((width - 0.1, 0.74, 0.14), "fabric", (0, 0, 0.2)), *seats, *backs, *arms, legs])


def clock() -> Part:
    """A wall clock of 30 cm whose back lies in y = 0; its face looks towards -y."""
    face = join([cylinder(0.14, 0.012, "paper", 40), torus(0.145, 0.012, "plastic", 40, 10).moved(z=0.01)])
    hands = boxes([(0.008, 0.1, 0.002), (0.006, 0.13, 0.002)], [(0, 0.04, 0.015), (0, 0.055, 0.018)], "metal",
                  np.stack([rotation(yaw=-60), rotation(yaw=40)]))  # fmt: skip
    return join([face, hands]).turned(roll=90)
