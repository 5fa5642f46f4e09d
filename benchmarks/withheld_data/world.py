"""Random places to record in: rooms, corridors, clutter and open yards of simple solids, and the house's own scenes."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthsim.materials import Materials, load_materials
from depthsim.procedural.part import Part, join
from depthsim.procedural.primitives import box, cylinder, sphere
from depthsim.procedural.registry import build
from depthsim.raycast import Caster
from depthsim.scene import Scene

Rng = np.random.Generator
Floats = NDArray[np.float64]

OWN = ("room", "corridor", "clutter", "yard")
HOUSE = ("office", "corridor", "tunnel", "race", "forest")
_FLOORS = ("tile", "wood", "carpet", "cement", "concrete")
_WALLS = ("plaster", "paint", "brick", "formboard", "cement")
_GLOSSY = ("tile", "metal", "aluminium", "plastic", "paint")
_DARK = ("rubber", "black_paint", "asphalt", "leather")
_OTHER = ("cardboard", "wood", "fabric", "foam", "paper", "formboard")


@dataclass(eq=False)
class World:
    """A scene, with what the generator must know of it.

    kind: one of OWN or ``house:NAME``. room: (2, 3) the box in which the camera may be, for the own ones [m].
    solids: (N, 2, 3) boxes about the things in it [m]. parts: the faces of each thing, as first and last + 1.
    sun: unit vector to the sun, where there is one.
    """

    kind: str
    scene: Scene
    room: Floats
    solids: Floats = field(default_factory=lambda: np.zeros((0, 2, 3)))
    parts: list[tuple[int, int]] = field(default_factory=list)
    sun: Floats | None = None
    materials: Materials = field(default_factory=load_materials)

    @cached_property
    def caster(self) -> Caster:
        """Made once."""
        return Caster(self.scene)

    def table(self, values: dict[str, float]) -> Floats:
        """(256,) a value for each tag index of the scene, 0 for no tag."""
        out = np.zeros(256)
        out[: len(self.scene.tags)] = [values[tag] for tag in self.scene.tags]
        return out

    def property(self, name: str) -> Floats:
        """(256,) a key of materials.yaml for each tag index of the scene."""
        return self.table({tag: float(getattr(self.materials[tag], name)) for tag in self.scene.tags})


def draw_world(rng: Rng, kind: str) -> World:
    """A random world; ``kind`` is one of OWN, or ``house:NAME``."""
    if kind.startswith("house:"):
        return _house(rng, kind)
    return _own(rng, kind)


def _house(rng: Rng, kind: str) -> World:
    part = build(kind.split(":")[1], seed=int(rng.integers(1, 1000)))
    scene = Scene(
        kind.split(":")[1],
        np.asarray(part.vertices, np.float64),
        part.faces.astype(np.uint32),
        part.face_tags.astype(np.uint8),
        part.tags,
    )
    return World(kind, scene, scene.bounds)


def _own(rng: Rng, kind: str) -> World:
    size = {
        "room": rng.uniform((3.2, 3.2, 2.4), (6.5, 6.5, 3.1)),
        "corridor": rng.uniform((1.7, 6.0, 2.3), (2.5, 11.0, 2.9)),
        "clutter": rng.uniform((2.8, 2.8, 2.4), (4.5, 4.5, 2.8)),
        "yard": rng.uniform((4.5, 4.5, 2.0), (7.5, 7.5, 2.8)),
    }[kind]
    palette = _palette(rng)
    pieces = _shell(rng, size, palette, ceiling=kind != "yard")
    count = {"room": (5, 10), "corridor": (3, 6), "clutter": (12, 20), "yard": (6, 12)}[kind]
    things = [_thing(rng, size, palette, small=kind in ("clutter", "corridor")) for _ in range(rng.integers(*count))]
    parts = [_divided(part, 0.5) for part in [*pieces, *things]]
    ends = np.cumsum([len(part.faces) for part in parts])
    starts = ends - [len(part.faces) for part in parts]
    whole = join(parts)
    scene = Scene(kind, whole.vertices, whole.faces.astype(np.uint32), whole.face_tags.astype(np.uint8), whole.tags)
    sun = None
    if kind == "yard":
        high, round_ = np.radians(rng.uniform(30, 65)), rng.uniform(0, 2 * np.pi)
        sun = np.array([np.cos(high) * np.cos(round_), np.cos(high) * np.sin(round_), np.sin(high)])
    solids = np.array([[part.vertices.min(axis=0), part.vertices.max(axis=0)] for part in things])
    spans = [(int(a), int(b)) for a, b in zip(starts, ends, strict=True)][len(pieces) :]
    return World(kind, scene, np.array([[0.0, 0.0, 0.0], size]), solids, spans, sun)


def _palette(rng: Rng) -> dict[str, list[str]]:
    """Three to six tags: of floor, walls and things, among them a glossy and a dark one."""
    floor, wall = str(rng.choice(_FLOORS)), str(rng.choice(_WALLS))
    things = [str(rng.choice(_GLOSSY)), str(rng.choice(_DARK)), *map(str, rng.choice(_OTHER, 2, replace=False))]
    walls = [wall, wall, wall, wall]
    if rng.random() < 0.4:
        walls[int(rng.integers(4))] = things[int(rng.integers(2))]
    return {"floor": [floor], "walls": walls, "ceiling": [wall], "things": things[: int(rng.integers(3, 5))]}


def _shell(rng: Rng, size: Floats, palette: dict[str, list[str]], ceiling: bool) -> list[Part]:
    """Floor, four walls and a ceiling, 0.1 m thick, that meet without a gap."""
    w, d, h = size
    t = 0.1
    parts = [box((w + 2 * t, d + 2 * t, t), palette["floor"][0], (w / 2, d / 2, -t / 2))]
    sides = [
        ((t, d + 2 * t, h), (-t / 2, d / 2, h / 2)),
        ((t, d + 2 * t, h), (w + t / 2, d / 2, h / 2)),
        ((w, t, h), (w / 2, -t / 2, h / 2)),
        ((w, t, h), (w / 2, d + t / 2, h / 2)),
    ]
    parts += [box(extent, tag, centre) for (extent, centre), tag in zip(sides, palette["walls"], strict=True)]
    if ceiling:
        parts.append(box((w + 2 * t, d + 2 * t, t), palette["ceiling"][0], (w / 2, d / 2, h + t / 2)))
    return parts


def _thing(rng: Rng, size: Floats, palette: dict[str, list[str]], small: bool) -> Part:
    """A box, pole, slanted panel, ball, table or hanging box at a random place on the floor or the wall."""
    tag = str(rng.choice(palette["things"]))
    scale = 0.6 if small else 1.0
    shape = rng.choice(["box", "pole", "panel", "ball", "table", "hanging"], p=[0.3, 0.14, 0.2, 0.1, 0.13, 0.13])
    yaw = float(rng.uniform(0, 360))
    if shape == "box":
        extent = scale * rng.uniform((0.2, 0.2, 0.2), (0.9, 0.9, 1.4))
        part = box(extent, tag, (0, 0, extent[2] / 2)).turned(yaw=yaw)
    elif shape == "pole":
        part = cylinder(scale * rng.uniform(0.05, 0.3), rng.uniform(0.5, size[2]), tag)
    elif shape == "panel":
        extent = scale * rng.uniform((0.5, 0.02, 0.7), (1.4, 0.05, 1.5))
        part = box(extent, tag).turned(roll=float(rng.uniform(-70, 70)), yaw=yaw)
        part = part.moved(z=-part.vertices[:, 2].min())
    elif shape == "ball":
        radius = scale * rng.uniform(0.12, 0.4)
        part = sphere(radius, tag).moved(z=radius + rng.uniform(0, 0.8))
    elif shape == "table":
        w, d, h = scale * rng.uniform((0.6, 0.5, 0.5), (1.5, 0.9, 0.9))
        legs = [box((0.05, 0.05, h), tag, (x, y, h / 2)) for x in (-w / 2.3, w / 2.3) for y in (-d / 2.3, d / 2.3)]
        part = join([box((w, d, 0.04), tag, (0, 0, h)), *legs]).turned(yaw=yaw)
    else:
        extent = scale * rng.uniform((0.15, 0.15, 0.15), (0.6, 0.6, 0.6))
        part = box(extent, tag).turned(*map(float, rng.uniform(-40, 40, 3))).moved(z=float(rng.uniform(0.9, 1.9)))
    # Half of the things stand near the walls, so that a way through the middle stays.
    place = rng.uniform(0.05, 0.95, 2)
    if rng.random() < 0.5:
        axis = int(rng.integers(2))
        place[axis] = rng.uniform(0.03, 0.15) if rng.random() < 0.5 else rng.uniform(0.85, 0.97)
    return part.moved(*(place * size[:2]))


def _divided(part: Part, edge: float) -> Part:
    """Large faces cut until no edge is longer than ``edge`` [m]: regions of a wall are faces of their own."""
    from trimesh.remesh import subdivide_to_size

    vertices, faces, index = subdivide_to_size(part.vertices, part.faces.astype(np.int64), edge, 12, return_index=True)
    return Part(np.asarray(vertices), faces.astype(np.uint32), part.face_tags[index], part.tags)
