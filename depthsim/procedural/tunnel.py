"""A mine drift: rough rock, rubble, a track with a tub, timber and steel support, pipes, a ventilation duct."""

import numpy as np

from depthsim.procedural import mine, rock
from depthsim.procedural.blocks import Block, blocks
from depthsim.procedural.drift import Drift, outline
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Floats, Part, copies, join, rotation, spin
from depthsim.procedural.primitives import box, boxes, cone, cylinder, lying, revolve, torus
from depthsim.procedural.sweep import SQUARE, circle, sweep, tube

LENGTH = 42.0
TRACK = -0.45
"""How far the track's middle lies left of the drift's [m]."""


def tunnel(seed: int = 1, rows: int = 720, around: int = 240) -> Part:
    """A bent mine drift of 42 m along x, 4 m wide and 3.4 m high, closed by rock at both ends.

    ``rows`` and ``around`` set the grid of the rock, 2·rows·around faces; the floor lies near z = 0.
    """
    for name, value, low, high in (("rows", rows, 100, 4000), ("around", around, 60, 1500)):
        if not low <= value <= high:
            raise ValueError(f"tunnel: {name} is {value}; give {low} to {high}")
    if rows * around > 500_000:
        raise ValueError(f"tunnel: rows · around is {rows * around}; give at most 500000")
    drift, stream = Drift(LENGTH), Stream(seed, 202)
    surface = drift.surface(rows, around, seed * 1000)
    return join(
        [
            drift.shell(surface, seed * 1000),
            _bolts(surface, stream),
            _rubble(drift, stream),
            *_track(drift, stream),
            *_timber(drift, stream),
            *_arches(drift),
            *_pipes(drift),
            _duct(drift),
            *_lamps(drift),
            *_stores(drift, stream),
        ]
    )


def _bolts(surface: Floats, stream: Stream) -> Part:
    """Rock bolts: a plate and a nut on the rock, in rows over the back and the upper walls."""
    rows, around = surface.shape[:2]
    row = np.arange(int(rows * 0.02), int(rows * 0.98), max(1, int(rows * 1.3 / LENGTH)))
    column = (np.linspace(0.38, 0.9, 7) * around).astype(int)
    i, j = (grid.ravel() for grid in np.meshgrid(row, column, indexing="ij"))
    i = np.clip(i + stream.integers(5, len(i)) - 2, 1, rows - 2)
    # The plate lies on the rock as the rock is over 20 cm, not at one vertex.
    along = surface[np.minimum(i + 2, rows - 1), j] - surface[i - 1, j]
    across = surface[i, (j + 2) % around] - surface[i, j - 2]
    normal = np.cross(across, along)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    frames = np.stack([along, np.cross(normal, along), normal], axis=2)
    bolt = join(
        [
            box((0.15, 0.15, 0.012), "metal", (0, 0, 0.035)),
            cone(0.045, 0.025, 0.025, "metal", 12).moved(z=0.04),
            cylinder(0.016, 0.13, "metal", 8).moved(z=0.01),
        ]
    )
    return copies(bolt, surface[i, j], frames)


def _rubble(drift: Drift, stream: Stream) -> Part:
    """Stones along the walls, a few on the floor, and the heap of muck at the face."""
    count = 320
    s = stream.uniform(0.8, LENGTH - 0.8, count)
    side = np.where(stream.uniform(size=count) < 0.5, -1, 1)
    left = side * (1.75 - 1.0 * stream.uniform(0, 1, count) ** 2.2)
    sizes = 0.05 + 0.33 * stream.uniform(0, 1, count) ** 3.5
    along = rock.rubble(stream, drift.at(s, left, sizes * 0.12), sizes, 2)
    pebbles = 900
    sizes = 0.025 + 0.08 * stream.uniform(0, 1, pebbles) ** 2
    places = drift.at(stream.uniform(0.5, LENGTH - 0.5, pebbles), stream.uniform(-1.7, 1.7, pebbles), sizes * 0.1)
    small = rock.rubble(stream, places, sizes, 1)
    places, sizes = rock.heap(stream, 150, 2.2, 1.35, (0.14, 0.75))
    muck = rock.rubble(stream, places * (0.9, 0.85, 1) + drift.at(LENGTH - 0.9, 0.2, 0.0), sizes, 2)
    core = (
        rock.stone(int(stream.integers(2**20, 1)[0]), 3, 0.4)
        .scaled(3.6, 3.4, 2.0)
        .moved(*drift.at(LENGTH - 0.8, 0.2, 0.0)[0])
    )
    return join([along, small, muck, core])


def _track(drift: Drift, stream: Stream) -> list[Part]:
    """A track of 60 cm gauge on wooden sleepers."""
    s = np.linspace(0.6, LENGTH - 2.2, 160)
    # Foot, web and head overlap a little, so that no two faces lie on one another.
    profile = (((0.035, 0.006), 0.006), ((0.007, 0.034), 0.042), ((0.02, 0.011), 0.082))
    parts = []
    for gauge in (-0.3, 0.3):
        for (wide, high), up in profile:
            parts.append(sweep(drift.at(s, TRACK + gauge, 0.075 + up), 1.0, SQUARE * (wide, high), "metal"))
    at = np.arange(1.0, LENGTH - 2.4, 0.7)
    yaw = np.array([drift.heading(float(value)) for value in at]) + stream.uniform(-4, 4, len(at))
    sizes = np.column_stack([stream.uniform(0.13, 0.19, len(at)), stream.uniform(1.0, 1.2, len(at)), at * 0 + 0.13])
    places = drift.at(at, TRACK + stream.uniform(-0.04, 0.04, len(at)), 0.012)
    return [*parts, boxes(sizes, places, "wood", rotation(yaw=yaw))]


def _timber(drift: Drift, stream: Stream) -> list[Part]:
    """Sets of round timber: two posts, a cap, boards behind and above."""
    parts = []
    for s in (4.0, 5.9, 7.8, 9.7):
        for side in (-1, 1):
            lean, thick = stream.number(-0.05, 0.05), stream.number(0.09, 0.12)
            heights = np.array([-0.2, 0.8, 1.7, 2.45])
            wobble = stream.uniform(-0.015, 0.015, 4)
            path = drift.at(s + lean + wobble, side * (1.55 - 0.03 * heights) + wobble, heights)
            parts.append(tube(path, thick * np.array([1.08, 1.03, 1.0, 0.96]), "wood", 14))
        cap = drift.at(np.full(5, s), np.linspace(-1.75, 1.75, 5), 2.53 + stream.uniform(-0.01, 0.01, 5))
        parts.append(tube(cap, stream.number(0.1, 0.12), "wood", 14))
    left = np.linspace(-1.45, 1.45, 9)
    for start in (3.8, 5.7, 7.6):
        for offset in left + stream.uniform(-0.05, 0.05, 9):
            path = drift.at(np.array([start, start + 2.25]), offset, 2.66 + stream.uniform(0, 0.04, 2))
            parts.append(sweep(path, 1.0, SQUARE * (stream.number(0.07, 0.12), 0.016), "wood"))
    return parts


def _arches(drift: Drift) -> list[Part]:
    """Steel arches with their foot plates, tied together by rods."""
    section = outline(240, inset=0.36)
    arch = section[section[:, 1] > 0.02]
    parts = []
    stations = (18.4, 19.9, 21.4, 22.9)
    for s in stations:
        path = drift.at(np.full(len(arch), s), arch[:, 0], arch[:, 1])[::3]
        for wide, high in ((0.06, 0.008), (0.01, 0.05)):
            parts.append(sweep(path, 1.0, SQUARE * (high, wide), "metal"))
        for foot in (arch[0], arch[-1]):
            parts.append(box((0.3, 0.3, 0.2), "wood").turned(yaw=drift.heading(s)).moved(*drift.at(s, foot[0], 0.0)[0]))
    for left, up in arch[[8, len(arch) // 3, 2 * len(arch) // 3, -9]]:
        parts.append(tube(drift.at(np.linspace(stations[0], stations[-1], 12), left, up), 0.014, "metal", 6))
    return parts


def _pipes(drift: Drift) -> list[Part]:
    """A compressed-air and a water pipe on brackets along the left wall, with flanges."""
    parts = []
    s = np.linspace(0.3, LENGTH - 5.0, 120)
    for left, up, radius, tag in ((1.4, 1.95, 0.06, "metal"), (1.42, 1.72, 0.035, "plastic")):
        parts.append(tube(drift.at(s, left, up), radius, tag, 16))
        for at in np.arange(2.2, LENGTH - 5.5, 4.0):
            flange = lying(cylinder(radius * 1.7, 0.05, "metal", 18))
            parts.append(flange.turned(yaw=drift.heading(float(at))).moved(*drift.at(at, left, up)[0]))
    for at in np.arange(1.2, LENGTH - 5.2, 2.5):
        turn = drift.heading(float(at))
        bracket = blocks(
            Block("metal", (-0.025, 0.025), (-0.15, 1.1), (-0.02, 0.02)),
            Block("metal", (-0.025, 0.025), (-0.15, -0.11), (-0.02, 0.16)),
        )
        parts.append(bracket.turned(yaw=turn).moved(*drift.at(at, 1.4, 1.66)[0]))
        parts.append(bracket.turned(yaw=turn).moved(*drift.at(at, 1.4, 1.87)[0]))
    return parts


def _duct(drift: Drift) -> Part:
    """A ribbed ventilation duct under the back, hung from straps."""
    s = np.arange(11.0, 36.0, 0.1)
    phase = np.arange(len(s)) % 6
    radius = 0.27 - 0.022 * np.sin(np.pi * phase / 6) - 0.01 * np.sin(s * 1.7)
    left, up = 0.5, 2.62 - 0.04 * np.sin(2 * np.pi * s / 3.0)
    hoops = np.arange(12.0, 36.0, 3.0)
    ring = torus(0.285, 0.012, "metal", 28, 6).turned(pitch=90)
    straps = [box((0.03, 0.008, 0.9), "metal", (0, 0, 0.7)).moved(*drift.at(at, left, 2.62)[0]) for at in hoops]
    rings = [ring.turned(yaw=drift.heading(float(at))).moved(*drift.at(at, left, 2.62)[0]) for at in hoops]
    return join([sweep(drift.at(s, left, up), radius, circle(24), "fabric"), *straps, *rings])


def _lamps(drift: Drift) -> list[Part]:
    """Caged lamps on the right wall and the cable that sags between them."""
    stations = np.arange(2.5, LENGTH - 3, 5.0)
    cage = [torus(0.075, 0.004, "metal", 20, 6).moved(z=z) for z in (-0.03, -0.09, -0.15)]
    rods = copies(cylinder(0.004, 0.19, "metal", 6).moved(0.075, 0, -0.17), np.zeros((6, 3)), spin(np.arange(6) * 60.0))
    bulb = revolve([(0, -0.15), (0.04, -0.13), (0.055, -0.08), (0.05, 0.0)], 18, "glass")
    lamp = join(
        [*cage, rods, bulb, cylinder(0.07, 0.09, "metal", 20), box((0.03, 0.7, 0.03), "metal", (0, -0.3, 0.06))]
    )
    parts = [lamp.turned(yaw=drift.heading(float(s))).moved(*drift.at(s, -1.2, 2.3)[0]) for s in stations]
    s = np.arange(stations[0], stations[-1] + 0.01, 0.25)
    sag = 0.16 * np.sin(np.pi * ((s - stations[0]) % 5.0) / 5.0)
    return [*parts, tube(drift.at(s, -1.24, 2.42 - sag), 0.012, "rubber", 8)]


def _stores(drift: Drift, stream: Stream) -> list[Part]:
    """The tub on the track; drums and crates in the refuge, a ladder, planks, a hose."""
    things = (
        (mine.tub(stream), 31.0, TRACK, 0.17, 0.0),
        (mine.drum(), 14.7, 1.75, 0.0, 0.0),
        (mine.drum(), 15.4, 1.9, 0.0, 40.0),
        (mine.crate(), 12.6, 1.25, 0.0, 8.0),
        (mine.crate(), 12.65, 1.25, 0.43, -6.0),
        (mine.ladder(), 24.3, 1.05, 0.0, 0.0),
        (mine.planks(stream), 28.6, 1.25, 0.0, 2.0),
        (mine.hose(), 34.0, 1.1, 0.0, 0.0),
    )
    return [p.turned(yaw=yaw + drift.heading(s)).moved(*drift.at(s, left, up)[0]) for p, s, left, up, yaw in things]
