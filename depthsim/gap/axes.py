"""What the cells of a view mean, in the units of its axis."""

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.covariates import EDGE_CODES, EDGE_DISTANCES
from depthsim.gap.evidence import Evidence
from depthsim.gap.views import ANGLES, View

Interval = tuple[float, float]


def interval_of(evidence: Evidence, view: View, cells: NDArray[np.int64]) -> Interval | None:
    """The part of the axis that the cells cover, or None where it has no order."""
    edges = edges_of(evidence, view)
    if edges is None or not len(cells):
        return None
    return float(edges[cells.min()]), float(edges[cells.max() + 1])


def edges_of(evidence: Evidence, view: View) -> NDArray[np.float64] | None:
    """(cells + 1,) where the cells of a view begin and end, or None where they have no order."""
    cuts, camera = evidence.cuts, evidence.camera
    if not view.single:
        return None
    depth = evidence.depths
    match view.axis:
        case "range":
            last = float(depth.max())
            return np.concatenate([[float(depth.min())], cuts.range, [last, last]])
        case "incidence":
            return np.concatenate([[0], np.degrees(np.arccos(ANGLES))[::-1], [90]])
        case "image_row":
            return np.linspace(0, camera.height, view.size + 1)
        case "image_column":
            return np.linspace(0, camera.width, view.size + 1)
        case "image_radius":
            return np.linspace(0, 1, view.size + 1)
        case "disparity_phase":
            return np.linspace(0, 1, view.size + 1)
        case "time":
            return _times(evidence)
        case "height":
            return np.concatenate([[evidence.heights[0]], cuts.height, [evidence.heights[1]]])
        case "motion":
            return np.concatenate([[0], cuts.flow, [max(float(evidence.fastest), float(cuts.flow[-1:].sum()))]])
    return None


def label_of(evidence: Evidence, view: View, cells: NDArray[np.int64]) -> str:
    """The cells in words."""
    cuts, camera = evidence.cuts, evidence.camera
    tags = {int(cuts.shown_tags[t]): name for t, name in enumerate(evidence.scene.tags) if cuts.shown_tags[t] >= 0}
    match view.axis:
        case "material":
            return ", ".join(tags.get(int(c), "other") for c in cells)
        case "range x material":
            ranges = len(cuts.range12) + 1
            names = dict.fromkeys(tags.get(int(c) // ranges, "other") for c in cells)
            which = np.unique(cells % ranges)
            edges = np.concatenate([[evidence.depths.min()], cuts.range12, [evidence.depths.max()]])
            return f"{', '.join(names)} at {edges[which.min()]:.2f} to {edges[which.max() + 1]:.2f} m"
        case "incidence x material":
            return "material " + ", ".join(dict.fromkeys(tags.get(int(c) // 9, "other") for c in cells))
        case "image_position" if view.size == 192:
            rows, columns = cells // 16, cells % 16
            height, width = camera.height / 12, camera.width / 16
            return (
                f"rows {rows.min() * height:.0f} to {(rows.max() + 1) * height:.0f}, "
                f"columns {columns.min() * width:.0f} to {(columns.max() + 1) * width:.0f}"
            )
        case "edge_distance":
            return ", ".join(dict.fromkeys(_edge(int(c)) for c in cells))
        case "surface" if view.single:
            return "; ".join(evidence.region_name(int(c)) for c in cells)
        case "surface":
            return "surfaces that face " + ", ".join(dict.fromkeys(_facing(int(c)) for c in cells))
        case "incidence x image_position":
            return "surfaces that slope " + ", ".join(dict.fromkeys(_slope(int(c)) for c in cells))
        case "time x range":
            return _time_and_range(evidence, cells)
        case "image_radius":
            return "surfaces that slope away from the image's middle or towards it"
        case "image_position":
            return "where a turn of the picture moves the depth"
        case "image_column":
            return "near the left border, by columns less disparity"
        case "motion":
            return "where the motion changes the depth"
        case "pixel_neighbours":
            return "neighbouring pixels"
        case "frame_neighbours":
            return "the same pixel in successive frames"
    return view.axis.replace("_", " ")


def _edge(cell: int) -> str:
    hidden, code = divmod(cell, EDGE_CODES)
    if code == 0:
        return "hidden from the right imager"
    distance, direction = (code - 1) % 5, (code - 1) // 5
    side = "behind" if direction < 4 else "before"
    where = ("left", "right", "above", "below")[direction % 4]
    begin = 1 if distance == 0 else EDGE_DISTANCES[distance - 1] + 1
    pixels = f"{begin}" if begin == EDGE_DISTANCES[distance] else f"{begin} to {EDGE_DISTANCES[distance]}"
    return f"{pixels} px {side} an edge {where}" + (", hidden" if hidden else "")


def _facing(cell: int) -> str:
    words = []
    for axis, value in zip("xyz", (cell // 9, cell // 3 % 3, cell % 3), strict=True):
        if value != 1:
            words.append(("-" if value == 0 else "+") + axis)
    return "".join(words) or "nowhere"


def _slope(cell: int) -> str:
    """Which way the depth grows, of 7 by 7 slopes."""
    x, y = cell // 7 - 3, cell % 7 - 3
    words = [("left", "right")[x > 0]] if x else []
    words += [("upwards", "downwards")[y > 0]] if y else []
    return " and ".join(words) or "nowhere"


def _times(evidence: Evidence) -> NDArray[np.float64]:
    """Where the cells of time begin and end [s], from the first frame of the recording: its clock may be any."""
    stamps = [still.stamp for still in evidence.stills.values()]
    edges = np.concatenate([[min(stamps)], evidence.cuts.times, [max(stamps)]])
    return np.asarray(edges - evidence.run.stamps[0])


def _time_and_range(evidence: Evidence, cells: NDArray[np.int64]) -> str:
    cuts = evidence.cuts
    ranges = len(cuts.range6) + 1
    times = _times(evidence)
    depths = np.concatenate([[evidence.depths.min()], cuts.range6, [evidence.depths.max()]])
    when, far = cells // ranges, cells % ranges
    return (
        f"{times[when.min()]:.2f} to {times[when.max() + 1]:.2f} s at "
        f"{depths[far.min()]:.2f} to {depths[far.max() + 1]:.2f} m"
    )
