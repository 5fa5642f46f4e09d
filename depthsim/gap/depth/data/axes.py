"""All axes of a run: range, incidence, material, image, scene, edges, time, motion, neighbours.

Each function makes one axis, with its cells and what they are called side by side.
"""

from collections.abc import Callable
from itertools import product

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.axis import Axis, Cells
from depthsim.gap.depth.data.covariates import EDGE_CODES, EDGE_DISTANCES, Covariates
from depthsim.gap.depth.data.cuts import Cuts
from depthsim.gap.depth.data.histograms import ACROSS, BEFORE, ERROR, FAR_LEFT, FAR_UP, LEFT, PHASE, STEPS, UP
from depthsim.gap.depth.data.lags import Lags

ANGLES = np.cos(np.radians([15, 25, 35, 45, 52, 58, 64, 69, 74, 79, 84]))[::-1].astype(np.float32)
_FEW_ANGLES = np.cos(np.radians([8, 16, 25, 38, 50, 60, 70, 78]))[::-1].astype(np.float32)
_ROWS, _COLUMNS = 12, 16
_PHASES, _RADII = 16, 10
_EDGE_BEGINS = (1, *(distance + 1 for distance in EDGE_DISTANCES[:-1]))
_WAYS = ("left", "right", "above", "below")
"""In which direction the nearest edge lies, in the order of the codes."""
_SIGNED = np.array([-4, -1.5, -0.5, -0.12, 0.12, 0.5, 1.5, 4], np.float32)
_SLOPES = np.array([-2, -0.6, -0.15, 0.15, 0.6, 2], np.float32)
Numbers = NDArray[np.integer]


def make_axes(k: Cuts, lags: Lags) -> list[Axis]:
    """All axes of a run, in the order in which they are counted."""
    return [
        _range(k),
        _material(k),
        _range_by_material(k),
        _incidence(k),
        _incidence_by_material(k),
        _image("image_row", 16, lambda c: _rows(c) * 16 // k.camera.height, k.camera.height),
        _image("image_column", 32, lambda c: _columns(c) * 32 // k.camera.width, k.camera.width),
        _image_radius(k),
        _image_position(k),
        _edge_distance(ERROR, single=True),
        _edge_distance(ACROSS, single=False),
        _disparity_phase(k),
        _time(k),
        _turn(),
        _time_by_range(k),
        _height(k),
        _surface(k),
        _facing(k),
        _motion(k),
        _drift(k),
        _slope(k),
        _radial(k),
        _roll(k),
        _left_band(k),
        *_instance(k),
        *_neighbours(k, lags),
        *(_steps(k, PHASE + number, step) for number, step in enumerate(k.steps)),
    ]


def _cut(values: NDArray[np.floating], edges: NDArray[np.floating]) -> NDArray[np.int16]:
    return np.searchsorted(edges, values).astype(np.int16)


def _hit(c: Covariates, cell: Numbers) -> Numbers:
    return np.where(c.depth > 0, cell, -1)


def _columns(c: Covariates) -> Numbers:
    return np.broadcast_to(np.arange(c.depth.shape[1]), c.depth.shape)


def _rows(c: Covariates) -> Numbers:
    """As they are counted in the whole picture."""
    return np.broadcast_to(c.rows[:, None], c.depth.shape)


def _plain(text: str) -> Callable[[NDArray[np.int64]], str]:
    return lambda _: text


def _ordered(name: str, size: int, cells: Cells, edges: NDArray[np.floating], unit: str) -> Axis:
    """An axis that its intervals say all of."""
    return Axis(name, ERROR, size, cells, _plain(name.replace("_", " ")), unit, edges=edges)


def _range(k: Cuts) -> Axis:
    """The last cell is that of the pixels without a surface."""

    def cells(c: Covariates, _: int) -> Numbers:
        return np.where(c.depth > 0, _cut(c.depth, k.range), len(k.range) + 1)

    first, last = k.depths
    return _ordered("range", len(k.range) + 2, cells, np.concatenate([[first], k.range, [last, last]]), "m")


def _material(k: Cuts) -> Axis:
    def label(cells: NDArray[np.int64]) -> str:
        return ", ".join(k.tag_name(int(c)) for c in cells)

    size = k.tag_cells
    bars = np.arange(size), tuple(k.tag_name(cell) for cell in range(size))
    return Axis("material", ERROR, size, lambda c, _: k.shown_tags[c.tag], label, bars=bars)


def _range_by_material(k: Cuts) -> Axis:
    ranges = len(k.range12) + 1
    edges = np.concatenate([[k.depths[0]], k.range12, [k.depths[1]]])

    def label(cells: NDArray[np.int64]) -> str:
        names = dict.fromkeys(k.tag_name(int(c) // ranges) for c in cells)
        which = np.unique(cells % ranges)
        return f"{', '.join(names)} at {edges[which.min()]:.2f} to {edges[which.max() + 1]:.2f} m"

    def cells(c: Covariates, _: int) -> Numbers:
        return _hit(c, k.shown_tags[c.tag] * ranges + _cut(c.depth, k.range12))

    return Axis("range x material", ERROR, k.tag_cells * ranges, cells, label, single=False)


def _incidence(k: Cuts) -> Axis:
    edges = np.concatenate([[0], np.degrees(np.arccos(ANGLES))[::-1], [90]])
    size = len(ANGLES) + 1
    return _ordered("incidence", size, lambda c, _: _hit(c, len(ANGLES) - _cut(c.cosine, ANGLES)), edges, "deg")


def _incidence_by_material(k: Cuts) -> Axis:
    angles = len(_FEW_ANGLES) + 1

    def label(cells: NDArray[np.int64]) -> str:
        return "material " + ", ".join(dict.fromkeys(k.tag_name(int(c) // angles) for c in cells))

    def cells(c: Covariates, _: int) -> Numbers:
        return _hit(c, k.shown_tags[c.tag] * angles + len(_FEW_ANGLES) - _cut(c.cosine, _FEW_ANGLES))

    return Axis("incidence x material", ERROR, k.tag_cells * angles, cells, label, single=False)


def _image(name: str, size: int, cells: Callable[[Covariates], Numbers], pixels: int) -> Axis:
    return _ordered(name, size, lambda c, _: cells(c), np.linspace(0, pixels, size + 1), "px")


def _radius(c: Covariates) -> NDArray[np.float32]:
    """(height, width): distance from the principal point, 1 at the whole picture's farthest corner."""
    return (np.hypot(*c.rays) / c.corner).astype(np.float32)


def _image_radius(k: Cuts) -> Axis:
    def cells(c: Covariates, _: int) -> Numbers:
        return np.minimum((_radius(c) * _RADII).astype(np.int16), _RADII - 1)

    return _ordered("image_radius", _RADII, cells, np.linspace(0, 1, _RADII + 1), "1")


def _image_position(k: Cuts) -> Axis:
    height, width = k.camera.height / _ROWS, k.camera.width / _COLUMNS

    def label(cells: NDArray[np.int64]) -> str:
        rows, columns = cells // _COLUMNS, cells % _COLUMNS
        return (
            f"rows {rows.min() * height:.0f} to {(rows.max() + 1) * height:.0f}, "
            f"columns {columns.min() * width:.0f} to {(columns.max() + 1) * width:.0f}"
        )

    def cells(c: Covariates, _: int) -> Numbers:
        return (_rows(c) * _ROWS // k.camera.height) * _COLUMNS + _columns(c) * _COLUMNS // k.camera.width

    return Axis("image_position", ERROR, _ROWS * _COLUMNS, cells, label, columns=_COLUMNS)


def _edge_distance(kind: int, *, single: bool) -> Axis:
    """Cells by side, direction and distance of the nearest depth edge; the second half is hidden from the right."""

    def cells(c: Covariates, _: int) -> Numbers:
        near = (c.edge > 0) | c.hidden
        return np.where(near, c.edge.astype(np.int16) + EDGE_CODES * c.hidden, -1)

    size = 2 * EDGE_CODES
    title = "from a depth edge [px]: - background, + foreground"
    return Axis("edge_distance", kind, size, cells, edge_names, "px", single, bars=_edge_bars(size), drawn_as=title)


def edge_names(cells: NDArray[np.int64]) -> str:
    """Cells of ``edge_distance`` (n,) in words: by side of the edge, the distances and the directions."""
    hidden, code = np.divmod(cells, EDGE_CODES)
    group, distance = np.divmod(code - 1, len(EDGE_DISTANCES))
    found = ["hidden from the right imager"] if np.any(code == 0) else []
    for number, away in product(range(2), range(2)):
        part = (code > 0) & (group // len(_WAYS) == number) & (hidden == away)
        if not part.any():
            continue
        begin, end = _EDGE_BEGINS[distance[part].min()], EDGE_DISTANCES[distance[part].max()]
        ways = [way for n, way in enumerate(_WAYS) if n in group[part] % len(_WAYS)]
        pixels = f"{begin}" if begin == end else f"{begin} to {end}"
        where = "" if len(ways) == len(_WAYS) else " " + " or ".join(ways)
        found.append(f"{pixels} px {('behind', 'before')[number]} an edge{where}" + (", hidden" if away else ""))
    return "; ".join(found)


def _edge_bars(size: int) -> tuple[NDArray[np.int64], tuple[str, ...]]:
    """Background side from far to near, then foreground side from near to far; what the right imager misses apart."""
    count = len(EDGE_DISTANCES)
    group = np.full(size, 2 * count)
    for code in range(1, EDGE_CODES):
        distance, background = (code - 1) % count, (code - 1) // count < 4
        group[code] = count - 1 - distance if background else count + distance
    spans = [str(a) if a == b else f"{a}-{b}" for a, b in zip(_EDGE_BEGINS, EDGE_DISTANCES, strict=True)]
    return group, (*(f"-{span}" for span in spans[::-1]), *(f"+{span}" for span in spans), "hidden")


def _disparity_phase(k: Cuts) -> Axis:
    def cells(c: Covariates, _: int) -> Numbers:
        disparity = k.camera.focal_baseline / np.maximum(c.depth, 1e-3)
        return _hit(c, np.minimum(((disparity - np.floor(disparity)) * _PHASES).astype(np.int16), _PHASES - 1))

    return _ordered("disparity_phase", _PHASES, cells, np.linspace(0, 1, _PHASES + 1), "px")


def _time_edges(k: Cuts) -> NDArray[np.float64]:
    """Where the cells of time begin and end [s], from the first frame of the recording: its clock may be any."""
    edges = np.concatenate([[k.times_seen[0]], k.times, [k.times_seen[1]]])
    return np.asarray(edges - k.stamps[0])


def _time_cell(k: Cuts, c: Covariates, frame: int) -> Numbers:
    return np.full(c.depth.shape, np.searchsorted(k.times, k.stamps[frame]))


def _time(k: Cuts) -> Axis:
    return _ordered("time", len(k.times) + 1, lambda c, frame: _time_cell(k, c, frame), _time_edges(k), "s")


def _turn() -> Axis:
    """Every other frame: projectors and exposures can be set to change by turns."""
    names = ("frames 0, 2, 4, ...", "frames 1, 3, 5, ...")

    def label(cells: NDArray[np.int64]) -> str:
        return "every other frame" + (f": {names[int(cells[0])]}" if len(cells) == 1 else "")

    def cells(c: Covariates, frame: int) -> Numbers:
        return np.full(c.depth.shape, frame % 2)

    return Axis("time", ERROR, 2, cells, label, bars=(np.arange(2), names), drawn_as="every other frame")


def _time_by_range(k: Cuts) -> Axis:
    ranges, times = len(k.range6) + 1, _time_edges(k)
    depths = np.concatenate([[k.depths[0]], k.range6, [k.depths[1]]])

    def label(cells: NDArray[np.int64]) -> str:
        when, far = cells // ranges, cells % ranges
        return (
            f"{times[when.min()]:.2f} to {times[when.max() + 1]:.2f} s at "
            f"{depths[far.min()]:.2f} to {depths[far.max() + 1]:.2f} m"
        )

    def cells(c: Covariates, frame: int) -> Numbers:
        return _hit(c, _time_cell(k, c, frame) * ranges + _cut(c.depth, k.range6))

    return Axis("time x range", ERROR, (len(k.times) + 1) * ranges, cells, label, single=False)


def _height(k: Cuts) -> Axis:
    edges = np.concatenate([[k.heights[0]], k.height, [k.heights[1]]])
    return _ordered("height", len(k.height) + 1, lambda c, _: _hit(c, _cut(c.height, k.height)), edges, "m")


def _surface(k: Cuts) -> Axis:
    def label(cells: NDArray[np.int64]) -> str:
        return "; ".join(k.region_name(int(c)) for c in cells)

    def cells(c: Covariates, _: int) -> Numbers:
        return _hit(c, k.region_of_face[np.maximum(c.face, 0)])

    return Axis("surface", ERROR, int(k.region_of_face.max()) + 1, cells, label)


def _instance(k: Cuts) -> list[Axis]:
    """The object, where there are several. No closer to a cause than the surface, of which objects are parts."""
    if len(k.instances) < 2:
        return []
    numbers, names = list(k.instances), tuple(k.instances.values())
    place = np.full(1 << 16, -1, np.int32)
    place[numbers] = np.arange(len(numbers))

    def label(cells: NDArray[np.int64]) -> str:
        return ", ".join(names[int(c)] for c in cells)

    bars = np.arange(len(names)), names
    return [Axis("instance", ERROR, len(names), lambda c, _: place[c.instance], label, single=False, bars=bars)]


def _facing(k: Cuts) -> Axis:
    """The surface by the way it faces in the world, three ways along each of x, y and z."""

    def cells(c: Covariates, _: int) -> Numbers:
        facing = c.normal * np.where(c.toward, 1, -1)
        x, y, z = (np.searchsorted([-0.38, 0.38], axis) for axis in facing)
        return _hit(c, x * 9 + y * 3 + z)

    def name(cell: int) -> str:
        ways = zip("xyz", (cell // 9, cell // 3 % 3, cell % 3), strict=True)
        return "".join(("-" if value == 0 else "+") + axis for axis, value in ways if value != 1) or "nowhere"

    def label(cells: NDArray[np.int64]) -> str:
        return "surfaces that face " + ", ".join(dict.fromkeys(name(int(c)) for c in cells))

    return Axis("surface", ERROR, 27, cells, label, single=False)


def _motion(k: Cuts) -> Axis:
    edges = np.concatenate([[0], k.flow, [max(k.fastest, float(k.flow[-1:].sum()))]])
    size = len(k.flow) + 1
    return _ordered("motion", size, lambda c, _: _hit(c, _cut(c.flow, k.flow)), edges, "rad/s")


def _drift(k: Cuts) -> Axis:
    """Where the depth would go in 10 ms, in spreads, and the third of the picture."""

    def cells(c: Covariates, _: int) -> Numbers:
        moves = c.drift * np.float32(0.01) * k.per_spread(c.depth, c.tag)
        return _hit(c, (_rows(c) * 3 // k.camera.height) * 9 + _cut(moves, _SIGNED))

    return Axis("motion", ERROR, 27, cells, _plain("where the motion changes the depth"), single=False)


def _slope(k: Cuts) -> Axis:
    """Where the depth would go for half a pixel in x and in y, in spreads."""

    def cells(c: Covariates, _: int) -> Numbers:
        per = k.per_spread(c.depth, c.tag) * np.float32(0.5)
        x, y = (_cut(s * per / np.float32(f), _SLOPES) for s, f in ((c.slope_x, k.camera.fx), (c.slope_y, k.camera.fy)))
        return _hit(c, x * 7 + y)

    def name(cell: int) -> str:
        x, y = cell // 7 - 3, cell % 7 - 3
        words = [("left", "right")[x > 0]] if x else []
        words += [("upwards", "downwards")[y > 0]] if y else []
        return " and ".join(words) or "nowhere"

    def label(cells: NDArray[np.int64]) -> str:
        return "surfaces that slope " + ", ".join(dict.fromkeys(name(int(c)) for c in cells))

    return Axis("incidence x image_position", ERROR, 49, cells, label, single=False)


def _radial(k: Cuts) -> Axis:
    """Where the depth would go if the ray went outwards, by the third of the image radius."""

    def cells(c: Covariates, _: int) -> Numbers:
        x, y = c.rays
        r = np.maximum(np.hypot(x, y), 1e-6)
        out = (x * c.slope_x + y * c.slope_y) / r * k.per_spread(c.depth, c.tag) / np.float32(2 * k.camera.fx)
        return _hit(c, np.minimum((_radius(c) * 3).astype(np.int16), 2) * 9 + _cut(out, _SIGNED))

    text = "surfaces that slope away from the image's middle or towards it"
    return Axis("image_radius", ERROR, 27, cells, _plain(text), single=False)


def _roll(k: Cuts) -> Axis:
    """Where the depth would go if the picture turned by half a degree."""

    def cells(c: Covariates, _: int) -> Numbers:
        x, y = c.rays
        turned = (x * c.slope_y - y * c.slope_x) * np.float32(np.radians(0.5)) * k.per_spread(c.depth, c.tag)
        return _hit(c, _cut(turned, _SIGNED))

    return Axis("image_position", ERROR, 9, cells, _plain("where a turn of the picture moves the depth"), single=False)


def _left_band(k: Cuts) -> Axis:
    """Columns from the left border, less the disparity."""

    def cells(c: Covariates, _: int) -> Numbers:
        beyond = _columns(c) - k.camera.focal_baseline / np.maximum(c.depth, 1e-3)
        return np.where((beyond < 40) & (c.depth > 0), np.clip(beyond / 2 + 4, 0, 23).astype(np.int16), -1)

    text = "near the left border, by columns less disparity"
    return Axis("image_column", ERROR, 24, cells, _plain(text), single=False)


def _neighbours(k: Cuts, lags: Lags) -> list[Axis]:
    """How errors go together, near pixels with those beside an edge apart, farther ones and frames by range."""
    few = len(k.range6) + 1

    def beside(c: Covariates, _: int) -> Numbers:
        return _hit(c, _cut(c.depth, k.range6) * 2 + (c.edge > 0))

    def ranges(c: Covariates, _: int) -> Numbers:
        return _hit(c, _cut(c.depth, k.range6))

    near, usual = "neighbouring pixels", Lags()
    left = near if lags.left == usual.left else f"pixels {lags.left} columns apart"
    up = near if lags.up == usual.up else f"pixels {lags.up} rows apart"
    before = "successive frames" if lags.frames == usual.frames else f"frames {lags.frames} apart"
    return [
        *(Axis("pixel_neighbours", kind, 2 * few, beside, _plain(near)) for kind in (LEFT, UP)),
        Axis("pixel_neighbours", FAR_LEFT, few, ranges, _plain(left)),
        Axis("pixel_neighbours", FAR_UP, few, ranges, _plain(up)),
        Axis("frame_neighbours", BEFORE, few, ranges, _plain(f"the same pixel in {before}")),
    ]


def _steps(k: Cuts, kind: int, step: float) -> Axis:
    """Only where the step is wider than the unit of the depth, which would hide it.

    Of steps that are none of the usual ones, where it is wider than millimetres too: depths may have been in these.
    """
    unit = k.camera.depth_scale
    least = 2.5 * unit if step in STEPS else 6 * max(unit, 0.001)

    def cells(c: Covariates, _: int) -> Numbers:
        seen = c.depth * c.depth * np.float32(step / k.camera.focal_baseline) > least
        return np.where(seen & (c.depth > 0), 0, -1)

    return Axis("disparity_phase", kind, 1, cells, _plain("disparity phase"), single=False)
