"""The profile d435 beside the real D435: the same figures of real frames and of the same frames simulated.

    ./run python benchmarks/d435_profile.py RUN [--sensor PROFILE] [--every 8]

RUN holds real frames of a floor, with its scene and its masks (data/d435_floor). Its scene is the floor alone, so what
happens at the edges of things is compared with frames of the scene `office` instead.
"""

import argparse
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import ndimage

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.scenefile import load_scene
from depthsim.sensor import Profile, Sensor, load_profile
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import SATURATED
from depthsim.trajectory import load_trajectory

Array = NDArray[np.float64]
WINDOW = 25
RANGES = (0.6, 0.75, 1.0, 1.25, 1.6, 2.0, 2.5, 3.2)
ANGLES = (40, 50, 60, 70, 75, 80)
SHORT = 1.6
"""[m] Correlations are read where the floor is nearer than this."""


OUTLIER = 0.5
"""[px] Correlations leave out what is farther off than this."""


@dataclass(frozen=True)
class Floor:
    """One frame over the floor. error: measured less true disparity [px], not a number where there is no measurement.

    depth and angle [deg] are those of the clean geometry, where mask allows.
    """

    error: Array
    disparity: Array
    mask: NDArray[np.bool_]
    depth: Array
    angle: Array


def floor_frames(run: Run, profile: Profile | None, indices: Iterable[int]) -> list[Floor]:
    """The run's own frames, or with ``profile`` those that `generate --like RUN` would make."""
    scene = load_scene(run.scene or "")
    caster, motion, camera = Caster(scene), Motion.along(run.trajectory, run.truth), run.camera
    sensor, frames = Sensor(caster, camera, profile.effects if profile else ()), []
    for index in indices:
        made = sensor.measure(run.poses[index], index=index, stamp=float(run.stamps[index]), motion=motion)
        units = made.depth_raw if profile else run.depth_raw(index)
        mask, clean = run.mask(index) & made.clean.hit, made.clean.depth.astype(float)
        valid = (units > 0) & (units < SATURATED)
        disparity = np.where(valid, camera.focal_baseline / np.maximum(units * camera.depth_scale, 1e-9), 0)
        error = np.where(mask & valid, disparity - camera.focal_baseline / np.maximum(clean, 1e-9), np.nan)
        angle = np.degrees(np.arccos(np.clip(made.clean.cosine.astype(float), 0, 1)))
        frames.append(Floor(error, disparity, mask, clean, angle))
    return frames


def local_statistics(frame: Floor) -> tuple[Array, NDArray[np.bool_], Array, Array]:
    """Std about the plane through each window, whole windows alone, window mean, and the error less that mean."""
    known = np.isfinite(frame.error)
    error = np.where(known, frame.error, 0)
    v, u = np.mgrid[: error.shape[0], : error.shape[1]].astype(float)

    def mean(x: Array) -> Array:
        return np.asarray(ndimage.uniform_filter(x, WINDOW))

    share = mean(known.astype(float))
    middle, spread = mean(error), (WINDOW**2 - 1) / 12
    along = [mean(error * axis) - middle * mean(axis) for axis in (u, v)]
    variance = mean(error**2) - middle**2 - sum(a**2 for a in along) / spread
    inside = np.where(known, error - middle / np.maximum(share, 1e-3), 0)
    return np.sqrt(np.maximum(variance, 0)), share > 0.999, middle, inside


def by_bins(frames: list[Floor], edges: tuple[float, ...], axis: Callable[[Floor], Array]) -> list[float]:
    """Median local std in bins of ``axis``."""
    found: list[list[Array]] = [[] for _ in edges[1:]]
    for frame in frames:
        std, whole, _, _ = local_statistics(frame)
        value = axis(frame)
        for at, (low, high) in enumerate(pairwise(edges)):
            found[at].append(std[whole & (value >= low) & (value < high)])
    return [float(np.median(np.concatenate(part))) if any(map(len, part)) else np.nan for part in found]


def lag_of_half(frames: list[Floor], axis: int) -> float:
    """The lag [px] where the correlation of the error, less its 25x25 mean, falls to 1/2, for lags along ``axis``."""
    curve = []
    for lag in range(20):
        top = bottom = 0.0
        for frame in frames:
            _, whole, _, inside = local_statistics(frame)
            use = whole & (frame.depth < SHORT) & (np.abs(inside) < OUTLIER)
            a, b = [slice(None)] * 2, [slice(None)] * 2
            a[axis], b[axis] = slice(0, use.shape[axis] - lag), slice(lag, None)
            both = use[tuple(a)] & use[tuple(b)]
            top += float((inside[tuple(a)] * inside[tuple(b)])[both].mean())
            bottom += float((inside[use] ** 2).mean())
        curve.append(top / bottom)
    below = next((k for k, value in enumerate(curve) if value < 0.5), len(curve) - 1)
    return below - (0.5 - curve[below]) / (curve[below - 1] - curve[below])


def frame_correlation(frames: list[Floor]) -> float:
    """Median correlation of a frame's local error with that of the next, at the same pixel."""
    found = []
    for first, second in zip(frames[::2], frames[1::2], strict=True):
        (_, whole, _, a), (_, whole_too, _, b) = local_statistics(first), local_statistics(second)
        use = whole & whole_too & (first.depth < SHORT) & (np.abs(a) < OUTLIER) & (np.abs(b) < OUTLIER)
        found.append(np.corrcoef(a[use], b[use])[0, 1])
    return float(np.median(found))


def floor_figures(frames: list[Floor]) -> dict[str, float]:
    """All figures of the floor, by name."""
    figures = {}
    for edges, unit, axis in ((RANGES, "m", lambda f: f.depth), (ANGLES, "°", lambda f: f.angle)):
        for low, high, std in zip(edges, edges[1:], by_bins(frames[::2], edges, axis), strict=False):
            figures[f"local noise at {low} to {high} {unit} [px]"] = std
    near = [local_statistics(f)[2][local_statistics(f)[1] & (f.depth < 2)] for f in frames[::2]]
    figures["spread of window means below 2 m [px]"] = float(np.concatenate(near).std())
    figures["lag of half correlation in x [px]"] = lag_of_half(frames[::4], 1)
    figures["lag of half correlation in y [px]"] = lag_of_half(frames[::4], 0)
    figures["correlation with the next frame"] = frame_correlation(frames)
    far = np.concatenate([f.disparity[np.isfinite(f.error) & (f.depth > 2)] for f in frames]) * 32
    figures["off the 1/32 px grid, of its steps (0.25 = no grid)"] = float(np.abs(far - np.round(far)).mean())
    error = np.concatenate([f.error[np.isfinite(f.error) & (f.depth < 3)] for f in frames])
    figures["more than 1 px off, below 3 m [%]"] = 100 * float((np.abs(error) > 1).mean())
    for low, high in ((0.6, 1.0), (1.0, 2.0), (2.0, 4.0)):
        parts = [np.isnan(f.error)[f.mask & (f.depth >= low) & (f.depth < high)] for f in frames]
        figures[f"holes at {low:g} to {high:g} m [%]"] = 100 * float(np.concatenate(parts).mean())
    return figures | {"band at the left less disparity, median [px]": band([f.disparity for f in frames])}


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


def show(console: Console, title: str, real: dict[str, float], made: dict[str, float]) -> None:
    table = Table(title, "real", "simulated")
    for name, value in real.items():
        table.add_row(name, f"{value:.3g}", f"{made[name]:.3g}")
    console.print(table)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=Path)
    parser.add_argument("--sensor", default="d435")
    parser.add_argument("--every", type=int, default=8, help="use every so many pairs of frames")
    options = parser.parse_args()
    console, run, profile = Console(), Run.open(options.run), load_profile(options.sensor)
    pairs = [k for first in range(0, len(run) - 1, options.every) for k in (first, first + 1)]
    real, made = floor_frames(run, None, pairs), floor_frames(run, profile, pairs)
    show(console, f"floor, {len(pairs)} frames", floor_figures(real), floor_figures(made))
    cluttered = [frame.disparity for frame in real[::2]]
    show(console, "edges; simulated: office", edge_figures(cluttered), edge_figures(office(profile, len(cluttered))))


if __name__ == "__main__":
    main()
