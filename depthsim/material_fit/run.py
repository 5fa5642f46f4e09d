"""std against distance for each material, from a run and its scene."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.material_fit.curve import Curve, Point
from depthsim.material_fit.spread import TILES, block_numbers, spread_of, tile_numbers
from depthsim.raycast import Caster
from depthsim.runs.folder import Run
from depthsim.scene import Scene

MOST_FRAMES = 200
"""Of a longer run so many frames are taken, evenly spread."""
MOST_PIXELS = 8_000_000
"""Of all pixels so many are taken, an even grid on every frame."""
LEAST_PIXELS = 500
"""A step of range with fewer depths is left out."""
_STEPS = 100_000
"""Steps of range that a tag may have: tag and step are kept as one number."""


def measure_run(run: Run, scene: Scene, *, width: float = 0.1, most_incidence: float = 70.0) -> list[Curve]:
    """std of depth against range, a curve for each material that the run sees.

    The error of a pixel is its depth minus the clean depth that is cast from ``scene`` at the run's pose. Errors are
    put together by material and by clean depth in steps of ``width`` [m]; a step counts at the mean depth in it. The
    std is taken about the mean of each patch, 1 / 8 of the image a side in one frame: a pose that is a little wrong
    or a warped floor then does not count as noise, as little as a tilted wall does. Where the run has masks, only what
    they trust is looked at, and only surfaces seen at up to ``most_incidence`` [deg]: the law was measured square to a
    wall, it knows nothing of the noise that real cameras add on tilted surfaces.
    Raises :class:`InputError` where nothing is left.
    """
    if not width > 0:
        raise InputError("`width`", "", f"is {width:g}", "give a width in metres above 0, such as 0.1")
    pixels, empty = _collect(run, scene, width, float(np.cos(np.radians(most_incidence))))
    block = block_numbers(int(pixels.frame.max()) + 1 if pixels.frame.size else 1)[pixels.frame]
    order = np.argsort(pixels.kind, kind="stable")
    cuts = np.flatnonzero(np.diff(pixels.kind[order])) + 1
    points: dict[int, list[Point]] = {}
    left_out: dict[int, int] = {}
    for chosen in np.split(order, cuts) if order.size else []:
        kind = int(pixels.kind[chosen[0]])
        tag = kind // _STEPS
        tile, patch = pixels.tile[chosen], pixels.frame[chosen] * TILES**2 + pixels.tile[chosen]
        spread = spread_of(pixels.error[chosen], (tile, block[chosen]), run.camera.depth_scale, patches=patch)
        if spread.kept.sum() < LEAST_PIXELS or spread.count == 0 or spread.std == 0:
            left_out[tag] = left_out.get(tag, 0) + 1
            continue
        holes, kept = empty.get(kind, 0), chosen[spread.kept]
        point = Point(
            distance=float(pixels.depth[kept].mean(dtype=np.float64)),
            std=spread.std,
            robust_std=spread.robust_std,
            bias=spread.mean,
            count=spread.count,
            pixels=kept.size,
            holes=holes / (holes + chosen.size),
            outliers=spread.outliers,
            incidence=float(np.degrees(np.arccos(pixels.cosine[kept])).mean(dtype=np.float64)),
        )
        points.setdefault(tag, []).append(point)
    if not points:
        fix = "check the scene, the poses and the masks"
        raise InputError(run.path, "", "no material is seen by enough depths to measure its noise", fix)
    return [
        Curve(scene.tags[tag], run.path.resolve().name, tuple(found), _too_few(left_out.get(tag, 0)), focal_baseline)
        for focal_baseline in [run.camera.focal_baseline]
        for tag, found in sorted(points.items())
    ]


def _too_few(steps: int) -> tuple[str, ...]:
    return (f"{steps} steps of range with too few depths",) if steps else ()


@dataclass(frozen=True)
class _Pixels:
    """What is known of each pixel looked at, (n,) each: kind is tag · _STEPS + step of range."""

    error: NDArray[np.float32]
    depth: NDArray[np.float32]
    cosine: NDArray[np.float32]
    kind: NDArray[np.int64]
    tile: NDArray[np.int64]
    frame: NDArray[np.int64]


def _collect(run: Run, scene: Scene, width: float, least_cosine: float) -> tuple[_Pixels, dict[int, int]]:
    """The pixels, and how many holes there are of each kind."""
    frames = np.linspace(0, len(run) - 1, min(len(run), MOST_FRAMES)).round().astype(int)
    every = int(np.ceil(np.sqrt(frames.size * run.camera.width * run.camera.height / MOST_PIXELS)))
    grid = (slice(every // 2, None, every),) * 2
    tiles = tile_numbers(*run.camera.shape)[grid]
    caster = Caster(scene)
    parts: list[tuple[NDArray, ...]] = []
    empty: dict[int, int] = {}
    for number, index in enumerate(frames):
        clean = caster.cast(run.camera, run.poses[index], stamps=float(run.stamps[index]))
        measured, depth, cosine, tag = (item[grid] for item in (run.depth(index), clean.depth, clean.cosine, clean.tag))
        mask = run.mask(index)
        trusted = (depth > 0) & (cosine >= least_cosine) & (True if mask is None else mask[grid])
        kind = tag.astype(np.int64) * _STEPS + np.minimum((depth / width).astype(np.int64), _STEPS - 1)
        there = trusted & (measured > 0)
        for hole, count in zip(*np.unique(kind[trusted & ~there], return_counts=True), strict=True):
            empty[int(hole)] = empty.get(int(hole), 0) + int(count)
        error = measured[there] - depth[there]
        parts.append((error, depth[there], cosine[there], kind[there], tiles[there], np.full(error.size, number)))
    return _Pixels(*(np.concatenate(part) for part in zip(*parts, strict=True))), empty
