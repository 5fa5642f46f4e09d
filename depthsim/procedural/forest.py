"""The edge of a forest: a meadow with a fence, bushes and tall grass, a track that leads in among the trees."""

import numpy as np

from depthsim.procedural import rock, trees
from depthsim.procedural.land import HALF_X, HIGH_Y, Land, to_track
from depthsim.procedural.noise import Stream
from depthsim.procedural.part import Floats, Part, copies, join, rotation, spin
from depthsim.procedural.primitives import box, boxes, cylinder, lying
from depthsim.procedural.sweep import circle, sweep, tube


def forest(seed: int = 1) -> Part:
    """A forest edge of 54 m (x) by 40 m (y): meadow to -y, forest to +y, about 12 m high; sky all round.

    The ground is near z = 0 at the origin. ``seed`` moves every plant and stone; the track stays.
    """
    land, stream = Land(seed * 1000), Stream(seed, 505)
    return join(
        [
            land.ground(),
            *_trees(land, stream),
            *_undergrowth(land, stream),
            _stones(land, stream),
            *_works(land, stream),
        ]
    )


def _scattered(stream: Stream, step: float, low_y: float, high_y: float) -> tuple[Floats, Floats]:
    """Points about ``step`` apart in a band of the scene [m]."""
    x, y = np.meshgrid(np.arange(-HALF_X + 1, HALF_X - 1, step), np.arange(low_y, high_y, step))
    shape = x.shape
    x = x + stream.uniform(-0.42, 0.42, shape) * step
    y = y + stream.uniform(-0.42, 0.42, shape) * step
    return x.ravel(), y.ravel()


def _trees(land: Land, stream: Stream) -> list[Part]:
    """Trees in detail near the track, coarse ones behind; broad-leaved at the edge, more spruces within."""
    x, y = _scattered(stream, 3.1, 1.6, HIGH_Y - 0.5)
    off = to_track(x, y)
    keep = off > np.where(y < 16, 2.5, 1.2)
    x, y, off = x[keep], y[keep], off[keep]
    near = (off < 4.6) & (y < 19)
    spruce = stream.uniform(size=len(x)) < np.clip(0.1 + 0.05 * y, 0, 0.6)
    crops = (
        (near & ~spruce, [trees.broadleaf(stream, h, c) for h, c in ((9.5, 2.7), (11.5, 3.1), (8.0, 2.5))]),
        (near & spruce, [trees.conifer(stream, h, 1.9) for h in (11.0, 8.5)]),
        (~near & ~spruce, [trees.broadleaf(stream, h, c, 12, 0, 20) for h, c in ((10.0, 2.2), (12.0, 2.6))]),
        (~near & spruce, [trees.conifer(stream, h, 1.2, detail=False) for h in (12.0, 9.0)]),
    )
    parts = []
    for chosen, kinds in crops:
        at = np.flatnonzero(chosen)
        for number, kind in enumerate(kinds):
            mine = at[number :: len(kinds)]
            size = stream.uniform(0.82, 1.12, len(mine))
            parts.append(
                copies(kind, land.place(x[mine], y[mine], 0.05), spin(stream.uniform(0, 360, len(mine)), size))
            )
    # A thicket of young spruces behind the end of the track, so that the view ends in trees.
    x, y = np.meshgrid(np.arange(-6.0, 22.0, 2.2), np.arange(15.5, HIGH_Y - 0.6, 2.2))
    x, y = (grid.ravel() + stream.uniform(-0.7, 0.7, grid.size) for grid in (x, y))
    keep = (to_track(x, y) > 1.6) & (stream.uniform(size=len(x)) < 0.7)
    thicket = [trees.conifer(stream, h, 0.3, detail=False) for h in (4.5, 3.2, 6.0)]
    return parts + _grown(land, stream, thicket, x[keep], y[keep])


def _undergrowth(land: Land, stream: Stream) -> list[Part]:
    """Bushes along the edge, ferns and saplings within, tufts of grass on the meadow near the track."""
    x, y = _scattered(stream, 1.9, -0.6, 2.2)
    keep = (to_track(x, y) > 1.9) & (stream.uniform(size=len(x)) < 0.62)
    parts = _grown(land, stream, [trees.bush(stream, h) for h in (1.7, 1.2, 0.8)], x[keep], y[keep])
    x, y = _scattered(stream, 1.7, 1.5, HIGH_Y - 1)
    off = to_track(x, y)
    keep = (off > 1.4) & (off < 9) & (stream.uniform(size=len(x)) < 0.6)
    parts += _grown(land, stream, [trees.fern(stream, s) for s in (0.7, 0.5, 0.85)], x[keep], y[keep])
    saplings = [trees.broadleaf(stream, 2.6, 0.6, 8, 2, 9), trees.conifer(stream, 1.9, 0.25, detail=False)]
    x, y = _scattered(stream, 4.1, 2.5, HIGH_Y - 1)
    keep = to_track(x, y) > 2.4
    parts += _grown(land, stream, saplings, x[keep], y[keep])
    x, y = _scattered(stream, 0.36, -10.0, 1.0)
    off = to_track(x, y)
    keep = (off > 0.95) & (stream.uniform(size=len(x)) < 0.95 * np.exp(-(((off - 0.9) / 1.1) ** 2)) + 0.06)
    parts += _grown(land, stream, [trees.tuft(stream, h) for h in (0.36, 0.26, 0.48, 0.2)], x[keep], y[keep])
    return [*parts, *_litter(land, stream)]


def _litter(land: Land, stream: Stream) -> list[Part]:
    """Fallen leaves and twigs beside the track."""
    x, y = _scattered(stream, 0.24, -0.5, 15.0)
    off = to_track(x, y)
    keep = stream.uniform(size=len(x)) < 0.85 * np.exp(-((off / 2.4) ** 2))
    places = land.place(x[keep], y[keep], -0.03)
    fallen = trees.foliage(stream, places, 0.03, 0.085, "leaf_litter")
    x, y = _scattered(stream, 1.3, 0.5, 15.0)
    off = to_track(x, y)
    keep = (off > 0.8) & (off < 5)
    feet = land.place(x[keep], y[keep], -0.03)
    aims = stream.directions(len(feet)) * (1, 1, 0.06)
    lines = trees.limbs(stream, feet, aims, stream.uniform(0.3, 1.3, len(feet)), 0.0, 4)
    return [fallen, sweep(lines, np.array([0.018, 0.015, 0.011, 0.005]), circle(5), "bark")]


def _grown(land: Land, stream: Stream, kinds: list[Part], x: Floats, y: Floats) -> list[Part]:
    """Plants of several kinds in turn at points (N,), each turned and sized its own way."""
    parts = []
    for number, kind in enumerate(kinds):
        px, py = x[number :: len(kinds)], y[number :: len(kinds)]
        turns = spin(stream.uniform(0, 360, len(px)), stream.uniform(0.75, 1.2, len(px)))
        parts.append(copies(kind, land.place(px, py, 0.02), turns))
    return parts


def _stones(land: Land, stream: Stream) -> Part:
    """Boulders at the edge and small stones on and beside the track."""
    places = [
        (-7.6, -1.3),
        (-6.7, -1.0),
        (-7.1, -2.0),
        (5.4, 1.6),
        (6.2, 1.1),
        (-1.6, 4.2),
        (0.2, 9.6),
        (5.6, 10.8),
        (-12.4, -2.6),
    ]
    big = np.array(places)
    sizes = stream.uniform(0.7, 1.7, len(big))
    boulders = rock.rubble(stream, land.place(big[:, 0], big[:, 1]) + np.outer(sizes, (0, 0, 0.1)), sizes, 3, 0.45)
    x, y = _scattered(stream, 0.85, -9.0, 18.0)
    keep = (to_track(x, y) < 1.6) & (stream.uniform(size=len(x)) < 0.8)
    small = stream.uniform(0.04, 0.2, int(keep.sum()))
    return join(
        [boulders, rock.rubble(stream, land.place(x[keep], y[keep]) + np.outer(small, (0, 0, 0.1)), small, 1, 0.4)]
    )


def _works(land: Land, stream: Stream) -> list[Part]:
    """A fence along the meadow, a pile of logs, a fallen trunk, stumps, a raised hide."""
    parts = []
    x = np.arange(-24.0, 6.1, 2.5)
    y = -9.6 + 0.8 * np.sin(x / 6)
    posts = land.place(x, y)
    parts.append(
        copies(cylinder(0.06, 1.5, "wood", 10).moved(z=-0.3), posts, rotation(*stream.uniform(-3, 3, (2, len(x)))))
    )
    overlap = np.array([0.15, 0, 0])
    for up in (0.45, 0.95):
        ends = posts + np.array([0, -0.07, up]) + stream.uniform(-0.03, 0.03, (len(x), 3))
        lines = np.stack([ends[:-1] - overlap, ends[1:] + overlap], axis=1)
        parts.append(sweep(lines, np.array([0.05, 0.042]), circle(8), "wood"))
    # Logs of 4 m, stacked in layers between two stakes.
    base = land.place(np.array([-8.9]), np.array([-0.2]), -0.05)[0]
    logs = []
    for layer, count in enumerate((6, 5, 4, 3)):
        for i in range(count):
            radius = stream.number(0.15, 0.19)
            log = join(
                [lying(cylinder(radius, 3.9, "bark", 16)), lying(cylinder(radius * 0.9, 3.92, "wood", 16)).moved(-0.01)]
            )
            logs.append(log.moved(stream.number(-2.1, -1.9), (i - (count - 1) / 2) * 0.38, 0.2 + layer * 0.32))
    parts.append(join(logs).turned(yaw=14).moved(*base))
    for at_x, at_y, yaw in ((6.4, 5.2, 15.0), (-4.6, 6.4, 125.0)):
        stem, _ = trees.trunk(stream, 7.0, 0.24, 14, 14)
        foot = land.place(np.array([at_x]), np.array([at_y]), -0.2)[0]
        parts.append(stem.turned(pitch=87, yaw=yaw).moved(*foot))
    for at_x, at_y in ((-2.2, 1.2), (5.2, 6.2), (-0.4, 12.0)):
        foot = land.place(np.array([at_x]), np.array([at_y]))[0]
        ring = [(0.02, 0, -0.2), (0, 0, 0.1), (0, 0, 0.45)]
        parts.append(join([tube(ring, [0.34, 0.26, 0.23], "bark", 18), cylinder(0.21, 0.455, "wood", 18)]).moved(*foot))
    return [*parts, _hide(land)]


def _hide(land: Land) -> Part:
    """A hunter's raised hide with its ladder."""
    foot = land.place(np.array([8.6]), np.array([-1.4]))[0]
    posts = [
        tube([(sx * 1.0, sy * 1.0, -0.3), (sx * 0.65, sy * 0.65, 4.6)], [0.075, 0.06], "wood", 10)
        for sx in (-1, 1)
        for sy in (-1, 1)
    ]
    braces = [tube([(-0.95, sy * 0.95, 0.4), (0.72, sy * 0.72, 2.5)], 0.035, "wood", 8) for sy in (-1, 1)]
    floor = boxes([(1.5, 0.14, 0.035)] * 10, [(0, -0.7 + 0.155 * i, 2.7) for i in range(10)], "wood")
    sides = [box((1.42, 0.025, 0.16), "wood", (0, y, 2.82 + 0.175 * i)) for y in (-0.72, 0.72) for i in range(5)]
    sides += [box((0.025, 1.42, 0.16), "wood", (-0.72, 0, 2.82 + 0.175 * i)) for i in range(5)]
    roof = boxes([(1.9, 0.2, 0.03)] * 9, [(0, -0.84 + 0.21 * i, 4.62) for i in range(9)], "wood").turned(roll=-7)
    ladder = [tube([(1.75, y, -0.2), (0.74, y, 2.9)], 0.035, "wood", 8) for y in (-0.22, 0.22)]
    rungs = [
        tube([(1.66 - 0.0978 * i, -0.24, 0.1 + 0.3 * i), (1.66 - 0.0978 * i, 0.24, 0.1 + 0.3 * i)], 0.022, "wood", 8)
        for i in range(9)
    ]
    return join([*posts, *braces, floor, *sides, roof, *ladder, *rungs]).turned(yaw=-60).moved(*foot)
