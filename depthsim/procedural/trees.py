"""Trees, bushes, ferns and grass; each stands on z = 0 about the origin, its foot a little below.

Stems and branches are closed; leaves, needles and blades are single triangles and strips, as thin as they are.
"""

import numpy as np

from depthsim.procedural.noise import Stream, facets
from depthsim.procedural.part import Floats, Part, join
from depthsim.procedural.sweep import circle, leaves, ribbons, sweep

GOLDEN = np.pi * (3 - 5**0.5)


def trunk(stream: Stream, height: float, radius: float, sides: int, steps: int) -> tuple[Part, Floats]:
    """A tapering stem with a flared, ridged foot, and its middle line (steps, 3) [m]."""
    t = np.linspace(0, 1, steps) ** 1.4
    sway = np.cumsum(stream.uniform(-0.012, 0.012, (steps, 2)), axis=0) * height
    path = np.column_stack([sway - sway[0], -0.3 + t * (height + 0.3)])
    size = radius * (1 - 0.88 * t) + radius * 0.7 * np.exp(-np.maximum(path[:, 2], 0) / 0.25)
    stem = sweep(path, size, circle(sides), "bark")
    center = np.column_stack([np.interp(stem.vertices[:, 2], path[:, 2], path[:, axis]) for axis in range(2)])
    ridge = 1 + 0.13 * facets(stem.vertices * (5, 5, 1.1), int(stream.integers(2**20, 1)[0]))
    vertices = stem.vertices.copy()
    vertices[:, :2] = center + (vertices[:, :2] - center) * ridge[:, None]
    return Part(vertices, stem.faces, stem.face_tags, stem.tags), path


def limbs(stream: Stream, starts: Floats, aims: Floats, lengths: Floats, lift: float, steps: int) -> Floats:
    """(N, steps, 3) bent lines from ``starts`` along unit ``aims``, turning up by ``lift`` (down if negative)."""
    t = np.linspace(0, 1, steps)[None, :, None]
    line = starts[:, None] + aims[:, None] * lengths[:, None, None] * t
    line[..., 2] += lift * lengths[:, None] * t[..., 0] ** 2
    wobble = stream.uniform(-0.06, 0.06, (len(starts), steps, 3)) * lengths[:, None, None] * t
    return np.asarray(line + wobble)


def broadleaf(
    stream: Stream, height: float = 10.0, clear: float = 2.6, branches: int = 15, twigs: int = 3, leaves_each: int = 24
) -> Part:
    """A broad-leaved tree whose crown begins at ``clear`` [m], with ``leaves_each`` leaves a twig.

    Without twigs it is a coarse one for far away, with ``leaves_each`` larger leaves a branch.
    """
    sides, steps = (5, 5) if twigs else (4, 4)
    stem, path = trunk(stream, height, height * 0.019, 12 if twigs else 7, 12 if twigs else 7)
    share = np.linspace(0, 1, branches) ** 0.85
    z = clear + (height * 0.97 - clear) * share
    yaw = np.arange(branches) * GOLDEN + stream.uniform(-0.4, 0.4, branches)
    rise = 0.15 + 0.9 * share + stream.uniform(-0.15, 0.15, branches)
    aims = np.stack([np.cos(rise) * np.cos(yaw), np.cos(rise) * np.sin(yaw), np.sin(rise)], axis=1)
    lengths = height * (0.1 + 0.17 * np.sin(np.pi * (0.22 + 0.68 * share))) * stream.uniform(0.8, 1.15, branches)
    starts = np.column_stack([np.interp(z, path[:, 2], path[:, axis]) for axis in range(3)])
    lines = limbs(stream, starts, aims, lengths, 0.22, steps)
    thick = height * (0.0075 * (1 - 0.6 * share))[:, None] * np.linspace(1, 0.25, steps)
    parts = [stem, sweep(lines, thick, circle(sides), "bark")]
    if twigs:
        along = stream.uniform(0.35, 1.0, (branches, twigs))
        at = np.clip((along * 4).astype(int), 0, 3)
        rows = np.arange(branches)[:, None]
        fraction = (along * 4 - at)[..., None]
        feet = (lines[rows, at] * (1 - fraction) + lines[rows, at + 1] * fraction).reshape(-1, 3)
        aims = np.repeat(aims, twigs, axis=0) + 0.9 * stream.directions(len(feet))
        aims /= np.linalg.norm(aims, axis=1, keepdims=True)
        ends = limbs(stream, feet, aims, stream.uniform(0.06, 0.13, len(feet)) * height, 0.1, 3)
        parts.append(sweep(ends, np.linspace(0.012, 0.004, 3), circle(3), "bark"))
        anchors, spread, size = ends[:, 1:].reshape(-1, 3), 0.032 * height, 0.0155 * height
        anchors = anchors[stream.integers(len(anchors), branches * twigs * leaves_each)]
    else:
        anchors, spread, size = lines[:, 1:].reshape(-1, 3), 0.075 * height, 0.036 * height
        anchors = anchors[stream.integers(len(anchors), branches * leaves_each)]
    return join([*parts, foliage(stream, anchors, spread, size)])


def foliage(stream: Stream, anchors: Floats, spread: float, size: float, tag: str = "foliage") -> Part:
    """One leaf near each anchor (N, 3), hanging a little; ``spread`` and the leaf's length ``size`` [m]."""
    count = len(anchors)
    bases = anchors + stream.directions(count) * stream.uniform(0, 1, (count, 1)) ** 0.6 * spread
    along = stream.directions(count) * (1, 1, 0.6) - np.array([0, 0, 0.3])
    along *= size * stream.uniform(0.75, 1.3, (count, 1)) / np.linalg.norm(along, axis=1, keepdims=True)
    across = np.cross(along, stream.directions(count) + np.array([0, 0, 1.2]))
    across *= 0.34 * size / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-3 * size)
    return leaves(bases, along, across, np.full(count, 0.12 * size), tag)


def conifer(stream: Stream, height: float = 11.0, clear: float = 1.6, detail: bool = True) -> Part:
    """A spruce: whorls of drooping branches with sprays of needles; without detail a coarse one for far away."""
    stem, path = trunk(stream, height, height * 0.015, 12 if detail else 7, 12 if detail else 7)
    whorls, around = (22, 6) if detail else (16, 7)
    level = np.repeat(np.linspace(0, 1, whorls), around)
    count = len(level)
    z = clear + (height * 0.985 - clear) * level + stream.uniform(-0.12, 0.12, count)
    yaw = (
        np.arange(count) * (2 * np.pi / around)
        + np.repeat(np.arange(whorls) * GOLDEN, around)
        + stream.uniform(-0.25, 0.25, count)
    )
    rise = -0.15 + 0.75 * level
    aims = np.stack([np.cos(rise) * np.cos(yaw), np.cos(rise) * np.sin(yaw), np.sin(rise)], axis=1)
    lengths = height * (0.2 * (1 - level) ** 0.8 + 0.015) * stream.uniform(0.8, 1.15, count)
    starts = np.column_stack([np.interp(z, path[:, 2], path[:, axis]) for axis in range(3)])
    lines = limbs(stream, starts, aims, lengths, -0.12, 4)
    if not detail:
        side = np.cross(aims, (0, 0, 1.0))
        width = lengths[:, None] * np.array([0.06, 0.2, 0.17, 0.0])
        return join([stem, ribbons(lines, side[:, None] * width[..., None], "needles")])
    wood = sweep(lines, 0.004 * height * np.linspace(0.6, 0.15, 4), circle(3), "bark")
    share = np.tile(np.linspace(0.18, 1.0, 5), 2)
    side = np.repeat([-1.0, 1.0], 5)
    at = np.clip((share * 3).astype(int), 0, 2)
    fraction = (share * 3 - at)[None, :, None]
    bases = lines[:, at] * (1 - fraction) + lines[:, at + 1] * fraction
    right = np.cross(aims, (0, 0, 1.0))
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    reach = (lengths[:, None] * (0.42 - 0.22 * share) + 0.1)[..., None]
    along = (
        0.75 * aims[:, None] + side[None, :, None] * right[:, None] * 0.8 + stream.uniform(-0.2, 0.2, bases.shape)
    ) * reach
    along[..., 2] -= 0.35 * reach[..., 0]
    across = np.cross(along.reshape(-1, 3), (0, 0, 1.0))
    across *= 0.04 / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-3)
    sprays = leaves(bases.reshape(-1, 3), along.reshape(-1, 3), across, np.full(len(across), 0.015), "needles")
    tips = leaves(lines[:, 2], (lines[:, 3] - lines[:, 2]) * 1.4, right * 0.06, np.full(count, 0.015), "needles")
    return join([stem, wood, sprays, tips])


def bush(stream: Stream, height: float = 1.6, stems: int = 11, count: int = 420) -> Part:
    """A bush: stems from one root, leaves all round."""
    yaw, lean = stream.uniform(0, 2 * np.pi, stems), stream.uniform(0.1, 0.7, stems)
    aims = np.stack([np.sin(lean) * np.cos(yaw), np.sin(lean) * np.sin(yaw), np.cos(lean)], axis=1)
    lines = limbs(stream, np.tile([0, 0, -0.1], (stems, 1)), aims, stream.uniform(0.7, 1.05, stems) * height, -0.1, 5)
    wood = sweep(lines, height * np.linspace(0.012, 0.003, 5), circle(5), "bark")
    anchors = lines[:, 1:].reshape(-1, 3)
    return join(
        [wood, foliage(stream, anchors[stream.integers(len(anchors), count)], 0.26 * height, 0.062 * height + 0.02)]
    )


def fern(stream: Stream, size: float = 0.6, fronds: int = 9) -> Part:
    """A fern: arching fronds with their leaflets."""
    yaw = np.arange(fronds) * (2 * np.pi / fronds) + stream.uniform(-0.3, 0.3, fronds)
    aims = np.stack([0.75 * np.cos(yaw), 0.75 * np.sin(yaw), np.full(fronds, 0.95)], axis=1)
    lines = limbs(stream, np.zeros((fronds, 3)), aims, stream.uniform(0.8, 1.1, fronds) * size, -0.75, 9)
    feet, ahead = lines[:, 2:-1], lines[:, 3:] - lines[:, 2:-1]
    right = np.cross(ahead, (0, 0, 1.0))
    right /= np.maximum(np.linalg.norm(right, axis=-1, keepdims=True), 1e-6)
    reach = size * 0.22 * np.linspace(1, 0.3, 6)[None, :, None]
    along = np.concatenate([s * right * reach + ahead * 0.6 for s in (-1, 1)]).reshape(-1, 3)
    across = np.concatenate([ahead, -ahead]).reshape(-1, 3) * 0.36
    blades = leaves(np.concatenate([feet, feet]).reshape(-1, 3), along, across, np.full(len(along), 0.004), "foliage")
    rib = np.cross(lines[:, -1] - lines[:, 0], (0, 0, 1.0))
    rib *= 0.006 / np.linalg.norm(rib, axis=1, keepdims=True)
    return join([blades, ribbons(lines, rib[:, None] * np.linspace(1, 0, 9)[None, :, None], "foliage")])


def tuft(stream: Stream, height: float = 0.3, blades: int = 12) -> Part:
    """A tuft of grass."""
    yaw, lean = stream.uniform(0, 2 * np.pi, blades), stream.uniform(0.05, 0.6, blades)
    aims = np.stack([np.sin(lean) * np.cos(yaw), np.sin(lean) * np.sin(yaw), np.cos(lean)], axis=1)
    feet = np.column_stack([stream.uniform(-0.07, 0.07, (blades, 2)), np.full(blades, -0.03)])
    lines = limbs(stream, feet, aims, stream.uniform(0.5, 1.1, blades) * height, -0.25, 3)
    side = np.stack([-np.sin(yaw), np.cos(yaw), 0 * yaw], axis=1)[:, None] * 0.007
    return ribbons(lines, side * np.array([1, 0.8, 0])[None, :, None], "grass")
