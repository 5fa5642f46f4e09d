"""Figures of depth frames over a known surface, and of what lies at depth edges: of real frames and of simulated ones.

All are of the error of the disparity [px], measured less true, in the camera of the pictures; "local" is the error less
its mean over 25x25 px, which leaves out what a pose, a mount or a slow warp does.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from depthsim.camera import Camera
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.scenefile import load_scene
from depthsim.sensor import Profile, Sensor
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import camera_for
from depthsim.trajectory import load_trajectory
from depthsim.units import SATURATED

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
WINDOW = 25
WHOLE = 0.9
"""The share of a window that has measurements, where it counts."""
RANGES = (0.6, 0.75, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2)
ANGLES = (40, 50, 60, 70, 75, 80)
LAGS = {"x": (1, 4, 8, 16), "y": (1, 2, 4, 8)}
OUTLIER = 0.5
"""[px] Figures of local errors leave out what is farther off than this."""
FAR_OFF = 2.0
"""[px] The same for what repeats in every frame: farther off is a thing that the scene does not have."""
OFTEN = 0.75
"""The share of the frames in which a pixel is measured, where figures over frames count it."""


@dataclass(frozen=True)
class Local:
    """error: less middle, its mean over the window; known: where that counts; std: about the window's plane."""

    error: Array
    known: Bools
    middle: Array
    std: Array


@dataclass(frozen=True)
class Surface:
    """One frame over a known surface. units: as stored. error: of the disparity [px], NaN where nothing is measured.

    depth [m] and angle [deg] are those of the clean geometry, where mask allows.
    """

    units: NDArray[np.uint16]
    error: Array
    disparity: Array
    mask: Bools
    depth: Array
    angle: Array

    @cached_property
    def local(self) -> Local:
        """The error about the plane through each window."""
        some = np.isfinite(self.error)
        error = np.where(some, self.error, 0)
        v, u = np.mgrid[: error.shape[0], : error.shape[1]].astype(float)

        def mean(x: Array) -> Array:
            return np.asarray(ndimage.uniform_filter(x, WINDOW))

        share = np.maximum(mean(some.astype(float)), 1e-3)
        middle, spread = mean(error) / share, (WINDOW**2 - 1) / 12
        along = [mean(error * axis) / share - middle * mean(np.where(some, axis, 0)) / share for axis in (u, v)]
        variance = mean(error**2) / share - middle**2 - sum(a**2 for a in along) / spread
        inside = np.where(some, error - middle, 0)
        known = some & (share > WHOLE) & (np.abs(inside) < OUTLIER)
        return Local(inside, known, middle, np.sqrt(np.maximum(variance, 0)))


def surface_frames(run: Run, profile: Profile | None, indices: Iterable[int], seed: int = 0) -> list[Surface]:
    """The run's own frames, or with ``profile`` those that `generate --like RUN` would make."""
    caster, motion, camera = Caster(load_scene(run.scene or "")), Motion.along(run.trajectory, run.truth), run.camera
    effects, clean, frames = profile.effects if profile else (), Sensor(caster, camera), []
    sensor = Sensor(caster, camera_for(camera, effects), effects)
    for index in indices:
        when = {"index": index, "stamp": float(run.stamps[index]), "motion": motion, "seed": seed}
        truth = clean.measure(run.poses[index], **when).clean
        units = sensor.measure(run.poses[index], **when).depth_raw if profile else run.depth_raw(index)
        frames.append(_surface(units.copy(), camera, run.mask(index) & truth.hit, truth.depth, truth.cosine))
    return frames


def _surface(
    units: NDArray[np.uint16], camera: Camera, mask: Bools, depth: NDArray[np.float32], cosine: NDArray[np.float32]
) -> Surface:
    valid, clean = (units > 0) & (units < SATURATED), depth.astype(float)
    disparity = np.where(valid, camera.focal_baseline / np.maximum(units * camera.depth_scale, 1e-9), 0)
    error = np.where(mask & valid, disparity - camera.focal_baseline / np.maximum(clean, 1e-9), np.nan)
    return Surface(units, error, disparity, mask, clean, np.degrees(np.arccos(np.clip(cosine.astype(float), 0, 1))))


def noise_figures(frames: Sequence[Surface]) -> dict[str, float]:
    """How large the noise is, how it is correlated, and what repeats in every frame; by name."""
    error = np.stack([frame.error for frame in frames])
    often = np.isfinite(error).mean(axis=0) >= OFTEN
    over_frames = error[:, often]
    over_frames = np.where(np.abs(over_frames) < FAR_OFF, over_frames, np.nan)
    over_frames = over_frames[:, np.isfinite(over_frames).sum(axis=0) > 1]
    std = np.concatenate([f.local.std[f.local.known] for f in frames])
    figures = {
        "temporal noise: std at a pixel over the frames, median [px]": float(
            np.nanmedian(np.nanstd(over_frames, axis=0, ddof=1))
        ),
        "local noise: std about the plane of 25x25 px, median [px]": float(np.median(std)),
    }
    for axis, name in ((1, "x"), (0, "y")):
        for lag in LAGS[name]:
            figures[f"autocorrelation at {lag} px in {name}"] = correlation(frames, lag, axis)
    for axis, name in ((1, "left neighbour"), (0, "neighbour above")):
        figures[f"equal to the {name} [%]"] = equal(frames, axis)
    return figures | {"fixed pattern: std of what repeats [px]": fixed_pattern(over_frames)}


def correlation(frames: Sequence[Surface], lag: int, axis: int) -> float:
    """Of the local error with that ``lag`` pixels on along ``axis``, in all frames together."""
    product = squares = other = 0.0
    for frame in frames:
        local = frame.local
        a, b = [slice(None)] * 2, [slice(None)] * 2
        a[axis], b[axis] = slice(0, local.error.shape[axis] - lag), slice(lag, None)
        both = local.known[tuple(a)] & local.known[tuple(b)]
        first, second = local.error[tuple(a)][both], local.error[tuple(b)][both]
        product, squares, other = product + first @ second, squares + first @ first, other + second @ second
    return float(product / np.sqrt(squares * other))


def equal(frames: Sequence[Surface], axis: int) -> float:
    """The share of measured pixels whose neighbour is measured, and as the same whole unit [%]."""
    same = pairs = 0
    for frame in frames:
        known = np.isfinite(frame.error)
        a, b = (np.take(frame.units, np.arange(k, frame.units.shape[axis] - 1 + k), axis) for k in (0, 1))
        both = np.take(known, np.arange(known.shape[axis] - 1), axis) & np.take(
            known, np.arange(1, known.shape[axis]), axis
        )
        same, pairs = same + int((a == b)[both].sum()), pairs + int(both.sum())
    return 100 * same / pairs


def fixed_pattern(over_frames: Array) -> float:
    """From (frames, pixels) errors: what the averages of the first and of the second half have in common.

    Their covariance has no part of a noise that the halves do not share; below 0 there is no pattern.
    """
    half = len(over_frames) // 2
    known = np.isfinite(over_frames[:half]).any(axis=0) & np.isfinite(over_frames[half:]).any(axis=0)
    first, second = np.nanmean(over_frames[:half, known], axis=0), np.nanmean(over_frames[half:, known], axis=0)
    return float(np.sqrt(max(np.cov(first, second)[0, 1], 0)))


def by_bins(frames: Sequence[Surface], edges: tuple[float, ...], axis: Callable[[Surface], Array]) -> list[float]:
    """Median local std in bins of ``axis``; NaN where there is none."""
    found: list[list[Array]] = [[] for _ in edges[1:]]
    for frame in frames:
        value = axis(frame)
        for at, (low, high) in enumerate(pairwise(edges)):
            found[at].append(frame.local.std[frame.local.known & (value >= low) & (value < high)])
    return [float(np.median(np.concatenate(part))) if any(map(len, part)) else np.nan for part in found]


def growth_figures(frames: Sequence[Surface]) -> dict[str, float]:
    """Local noise by range and by angle, holes by range, and the rest that a moving camera shows of a floor."""
    figures = {}
    for edges, unit, axis in ((RANGES, "m", lambda f: f.depth), (ANGLES, "°", lambda f: f.angle)):
        for low, high, std in zip(edges, edges[1:], by_bins(frames, edges, axis), strict=False):
            figures[f"local noise at {low} to {high} {unit} [px]"] = std
    near = [f.local.middle[f.local.known & (f.depth < 2)] for f in frames]
    figures["spread of the window's means below 2 m [px]"] = float(np.concatenate(near).std())
    figures["correlation of local errors with the next frame"] = frame_correlation(frames)
    far = np.concatenate([f.disparity[np.isfinite(f.error) & (f.depth > 2)] for f in frames]) * 32
    figures["off the 1/32 px grid beyond 2 m, of its steps (0.25 = no grid)"] = float(
        np.abs(far - np.round(far)).mean()
    )
    error = np.concatenate([f.error[np.isfinite(f.error) & (f.depth < 3)] for f in frames])
    figures["more than 1 px off, below 3 m [%]"] = 100 * float((np.abs(error) > 1).mean())
    for low, high in ((0.6, 1.0), (1.0, 2.0), (2.0, 4.0)):
        parts = [np.isnan(f.error)[f.mask & (f.depth >= low) & (f.depth < high)] for f in frames]
        figures[f"holes at {low:g} to {high:g} m [%]"] = 100 * float(np.concatenate(parts).mean())
    return figures | {"band at the left less disparity, median [px]": band([f.disparity for f in frames])}


def frame_correlation(frames: Sequence[Surface]) -> float:
    """Median correlation of a frame's local error with that of the next, at the same pixel; frames come in pairs."""
    found = []
    for first, second in zip(frames[::2], frames[1::2], strict=True):
        use = first.local.known & second.local.known & (first.depth < 1.6)
        found.append(np.corrcoef(first.local.error[use], second.local.error[use])[0, 1])
    return float(np.median(found))


def band(pictures: list[Array]) -> float:
    """How many more columns than its disparity lie left of a row's first measurement."""
    wider = []
    for d in pictures:
        first = (d > 0).argmax(axis=1)
        rows = np.flatnonzero((d > 0).any(axis=1) & (first < 100))
        wider.append(first[rows] - d[rows, first[rows]])
    return float(np.median(np.concatenate(wider)))


def edge_figures(pictures: list[Array]) -> dict[str, float]:
    """Figures of depth edges, from disparity pictures alone."""
    wider, right, nearer, farther = [], [], 0, 0
    between = near_edges = 0
    for d in pictures:
        a, b = d[:, :-1], d[:, 1:]
        nearer += int(((a > 0) & (b - a > 2)).sum())
        farther += int(((b > 0) & (a - b > 2)).sum())
        for row in d:
            at = np.flatnonzero(row > 0)
            width, step = np.diff(at) - 1, np.diff(row[at])
            wider.append((width - step)[(width > 0) & (step > 2)])
            right.append(width[(width > 0) & (step < -2)])
        # In between: a narrow thing whose two neighbours, three columns away, are of two surfaces.
        low, high = np.minimum(d[:, :-6], d[:, 6:]), np.maximum(d[:, :-6], d[:, 6:])
        edge = (low > 0) & (high - low > 3) & (d[:, 3:-3] > 0)
        share = (d[:, 3:-3] - low) / np.maximum(high - low, 1e-9)
        near_edges, between = (
            near_edges + int(edge.sum()),
            between + int((edge & (share > 0.25) & (share < 0.75)).sum()),
        )
    left, holes = np.concatenate(wider), np.concatenate(right)
    figures = {
        f"hole left of a near thing less the step, {q} % [px]": float(np.percentile(left, q)) for q in (25, 50, 75)
    }
    figures |= {f"hole on its right, {q} % [px]": float(np.percentile(holes, q)) for q in (25, 50, 75)}
    figures["jumps to something nearer without a hole [%]"] = 100 * nearer / (nearer + left.size)
    figures["jumps to something farther without a hole [%]"] = 100 * farther / (farther + holes.size)
    figures["in between, of the pixels within 3 px of an edge [%]"] = 100 * between / max(near_edges, 1)
    figures["band at the left less disparity, median [px]"] = band(pictures)
    figures["holes [%]"] = 100 * float(np.mean([(d == 0).mean() for d in pictures]))
    return figures


def office(profile: Profile, count: int) -> list[Array]:
    """Disparity pictures of the office, 640x480."""
    scene, camera = load_scene("office"), preset("d435", 640, 480)
    sensor, path = Sensor(Caster(scene), camera, profile.effects), load_trajectory(None, scene, camera.rate)
    made = []
    for index in np.linspace(0, len(path) - 1, count).astype(int):
        depth = sensor.measure(path.matrices()[index], index=int(index), motion=Motion.along(path)).depth_raw * 1e-3
        made.append(np.where(depth > 0, camera.focal_baseline / np.maximum(depth, 1e-9), 0))
    return made
