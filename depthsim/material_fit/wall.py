"""std against distance from captures of a flat wall at known distances."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera, read_camera
from depthsim.errors import InputError
from depthsim.material_fit.captures import Capture, find_captures
from depthsim.material_fit.curve import Curve, Point
from depthsim.material_fit.plane import PARAMETERS, plane_depth
from depthsim.material_fit.spread import block_numbers, effective_count, spread_of, tile_numbers
from depthsim.runs.png import decode_png

MOST_FRAMES = 100
"""Of a longer capture so many frames are taken, evenly spread."""
_LEAST_PIXELS = 100
_SATURATED = 65535


def measure_wall(
    folders: Sequence[Path],
    tag: str,
    *,
    camera: Camera | None = None,
    depth_scale: float | None = None,
    roi: float = 0.5,
) -> Curve:
    """std of depth against distance, from captures of a flat wall (the recording of the paper's section 2).

    folders: as :func:`~depthsim.material_fit.captures.find_captures` takes them.
    camera: of the pictures; without it the camera.yaml in a capture's folder or beside it. depth_scale [m per unit]
    overrides the camera's, and alone is enough.
    roi: the central share of the image's width and height that is looked at.

    Holes and saturated pixels are left out. From each frame the plane that fits it best is taken away, so that a wall
    that is a little tilted, or stands a little off, does not count as noise; what is left is the spatial std. The
    temporal std is that of each pixel over the frames. Raises :class:`InputError`, also where less than one distance
    can be measured.
    """
    if not 0 < roi <= 1:
        raise InputError("`roi`", "", f"is {roi:g}", "give a share of the image above 0 and up to 1, such as 0.5")
    captures = find_captures(folders)
    points: list[Point] = []
    left_out: list[str] = []
    used: Camera | None = None
    for capture in captures:
        used = camera or _camera_of(capture, depth_scale is None)
        scale = depth_scale or (used.depth_scale if used else 0.0)
        window = _read(capture, used, scale, roi)
        point = _measure(window, capture)
        if isinstance(point, Point):
            points.append(point)
        else:
            left_out.append(f"{capture.distance:g} m: {point}")
    source = folders[0].resolve().name if len(folders) == 1 else f"{len(folders)} folders"
    if not points:
        raise InputError(folders[0], "", f"no distance can be measured ({left_out[0]})", "record the wall again")
    return Curve(tag, source, tuple(points), tuple(left_out), used.focal_baseline if used else None)


@dataclass(frozen=True)
class _Window:
    """The central part of a capture: depth (frames, height, width) [m], 0 = none; x and y (height, width); the unit."""

    depth: NDArray[np.float32]
    x: NDArray[np.float32]
    y: NDArray[np.float32]
    unit: float


def _camera_of(capture: Capture, needed: bool) -> Camera | None:
    for folder in (capture.folder, capture.folder.parent):
        if (folder / "camera.yaml").exists():
            return read_camera(folder / "camera.yaml")
    if needed:
        fix = "put one there or beside it, or give `camera` d435 or `depth_scale` 0.001"
        raise InputError(capture.folder, "camera.yaml", "is missing", fix)
    return None


def _read(capture: Capture, camera: Camera | None, scale: float, roi: float) -> _Window:
    chosen = np.linspace(0, len(capture.files) - 1, min(len(capture.files), MOST_FRAMES)).round().astype(int)
    shape: tuple[int, int] | None = camera.shape if camera else None
    frames = []
    for file in (capture.files[index] for index in chosen):
        raw = decode_png(file)
        if raw.dtype != np.uint16 or raw.ndim != 2:
            raise InputError(file, "", "is not 16-bit grey", "write depth as a 16-bit grey PNG")
        shape = shape or (raw.shape[0], raw.shape[1])
        if raw.shape != shape:
            size, wanted = (f"{item[1]}x{item[0]}" for item in (raw.shape, shape))
            other = "the camera" if camera else "the first picture"
            raise InputError(file, "", f"is {size}, {other} is {wanted}", "correct the file or the camera")
        part = raw[_middle(shape, roi)]
        frames.append(np.where(part == _SATURATED, 0, part).astype(np.float32) * np.float32(scale))
    if camera is not None:
        x, y = (item[_middle(camera.shape, roi)] for item in camera.rays)
    else:  # without distortion, pixels differ from rays by a linear map only
        y, x = np.indices(frames[0].shape, np.float32) / np.float32(max(frames[0].shape))
    return _Window(np.stack(frames), x, y, scale)


def _middle(shape: tuple[int, int], roi: float) -> tuple[slice, slice]:
    """The central share of an image."""
    rows, columns = (slice(int(size * (1 - roi) / 2), size - int(size * (1 - roi) / 2)) for size in shape)
    return rows, columns


def _measure(window: _Window, capture: Capture) -> Point | str:
    """The point of a capture, or why there is none."""
    depth, seen = window.depth, window.depth > 0
    enough = seen.reshape(len(depth), -1).sum(axis=1) >= _LEAST_PIXELS
    if not enough.any():
        return f"{capture.folder.name} has no frame with {_LEAST_PIXELS} depths in the middle of the image"
    seen &= enough[:, None, None]
    middle = float(np.median(depth[seen]))
    if not 0.5 < middle / capture.distance < 2:
        problem = f"the wall is {middle:.3g} m away by its depth, {capture.distance:g} m by its name"
        raise InputError(capture.folder, "", problem, "correct the distance or the depth scale")
    parts = []
    for index in np.flatnonzero(enough):
        there = seen[index]
        z = depth[index][there]
        parts.append(z - plane_depth(z, window.x[there], window.y[there], window.unit))
    errors = np.concatenate(parts)
    frame, row, column = np.nonzero(seen)
    tile = tile_numbers(*depth.shape[1:])[row, column]
    block = block_numbers(len(depth))[frame]
    spread = spread_of(errors, (tile, block), window.unit, fitted=PARAMETERS * len(parts))
    if spread.std == 0:
        return f"{capture.folder.name} has no noise at all: every pixel holds the same plane"
    if spread.count == 0:
        return f"{capture.folder.name} has depths in too small a part of the image"
    seen[frame[~spread.kept], row[~spread.kept], column[~spread.kept]] = False
    temporal_std, temporal_count = _temporal(depth, seen)
    return Point(
        distance=capture.distance,
        std=spread.std,
        robust_std=spread.robust_std,
        bias=float(depth[seen].mean(dtype=np.float64)) - capture.distance,
        count=spread.count,
        pixels=int(seen.sum()),
        holes=float(1 - (depth > 0).mean()),
        outliers=spread.outliers,
        temporal_std=temporal_std,
        temporal_count=temporal_count,
    )


def _temporal(depth: NDArray[np.float32], seen: NDArray[np.bool_]) -> tuple[float, float]:
    """The std of a pixel over the frames, pooled over the pixels, and its effective count."""
    number = seen.sum(axis=0)
    mean = np.where(seen, depth, 0).sum(axis=0, dtype=np.float64) / np.maximum(number, 1)
    squares = np.where(seen, (depth - mean) ** 2, 0).sum(axis=0)
    freedom = np.maximum(number - 1, 0).astype(np.float64)
    total = float(freedom.sum())
    if total == 0:
        return float("nan"), float("nan")
    tiles = tile_numbers(*number.shape).ravel()
    return float(np.sqrt(squares.sum() / total)), effective_count(squares.ravel(), freedom.ravel(), (tiles,))
