"""The figures of the recording, of the simulator before, and of that with the causes, on the same pixels.

On the frames that are reported on, which nothing was fitted to. Simulated are a few runs with random numbers of their
own; the intervals are by the jackknife over blocks of frames, which has the spread of both frames and runs in it.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.findings import Findings
from depthsim.gap.depth.fit.poses import without_errors
from depthsim.gap.depth.tasks import patches as on_patches
from depthsim.gap.depth.tasks.figures import FIGURES
from depthsim.gap.depth.tasks.obstacles import obstacle_figures, occupancy
from depthsim.gap.depth.tasks.pixels import pixel_figures
from depthsim.gap.depth.tasks.view import View
from depthsim.gap.diagnosis import Task, rounded
from depthsim.gap.resampling import jackknife_half
from depthsim.sensor.effect import Effect
from depthsim.sensor.effects.pose_noise import PoseNoise

Floats = NDArray[np.float64]
Stored = NDArray[np.uint16]
NAMES = tuple(FIGURES)
RUNS = 3
"""Simulated runs of each sensor."""
_MILLI = 1000.0


def tasks_of(found: Findings) -> tuple[Task, ...]:
    """What a robot's software would see of a recording that was diagnosed; without causes, after is as before."""
    evidence, causes = found.evidence, [cause.effect for cause in found.diagnosis.causes]
    after = found.fixed.effects
    if PoseNoise.id not in causes and not any(isinstance(effect, PoseNoise) for effect in evidence.base):
        after = without_errors(after)  # these frames are registered
    return measure_tasks(evidence, [evidence.base, after] if causes else [evidence.base])


def measure_tasks(evidence: Evidence, sensors: Sequence[Sequence[Effect]]) -> tuple[Task, ...]:
    """The figures of the recording and of one or two sensors, before and after; of one, after is as before."""
    blocks = evidence.test
    shares = np.stack(evidence.each(lambda block: _block(evidence, sensors, block), blocks), axis=1)
    # (recording and runs, blocks, figures, 2) to (recording, before, after; ...): the runs of a sensor together.
    numbers = range(len(sensors))
    by_sensor = np.stack([shares[0], *(shares[1 + RUNS * n : 1 + RUNS * (n + 1)].sum(axis=0) for n in numbers)])
    if len(sensors) == 1:
        by_sensor = by_sensor[[0, 1, 1]]
    return tuple(_task(name, by_sensor[:, :, number]) for number, name in enumerate(NAMES))


def _block(evidence: Evidence, sensors: Sequence[Sequence[Effect]], block: int) -> Floats:
    """(1 + sensors x RUNS, figures, 2) sums and weights of one block."""
    indices = [int(i) for i in evidence.blocks[block]]
    runs = [[evidence.recorded(i) for i in indices]]
    for effects in sensors:
        runs += [evidence.pictures(effects, block, Seed("tasks", run)) for run in range(RUNS)]
    found = np.zeros((len(runs), len(NAMES), 2))
    earlier: tuple[View, list[Stored]] | None = None
    for index, pictures in zip(indices, zip(*runs, strict=True), strict=True):
        view = View.of(evidence, index)
        found += _frame(view, list(pictures), earlier)
        earlier = view, list(pictures)
    return found


def _frame(view: View, pictures: list[Stored], earlier: tuple[View, list[Stored]] | None) -> Floats:
    """(pictures, figures, 2) sums and weights of one frame, of pictures (rows, width) as they are stored."""
    found = np.zeros((len(pictures), len(NAMES), 2))
    depths = [view.depth(units) for units in pictures]
    truth = occupancy(view, view.depth_of_scene())
    for number, depth in enumerate(depths):
        shares = pixel_figures(view, depth) | obstacle_figures(truth, occupancy(view, depth))
        for name, share in shares.items():
            found[number, NAMES.index(name)] = share
    flat = on_patches.flat_patches(view)
    planes = np.stack([on_patches.plane_errors(view, depth, flat) for depth in depths])
    _add(found, "plane_rms", _MILLI * planes[:, :, on_patches.PLANE])
    _add(found, "subpixel_rms", planes[:, :, on_patches.SUBPIXEL])
    _add(found, "z_accuracy", 100 * planes[:, :, on_patches.ACCURACY])
    if earlier is not None:
        before, stored = earlier
        every = on_patches.cut_patches(view)
        pairs = zip(depths, map(before.depth, stored), strict=True)
        noise = [on_patches.noise_between(view, depth, before, last, every) for depth, last in pairs]
        _add(found, "temporal_noise", _MILLI * np.stack(noise))
    return found


def _add(found: Floats, name: str, values: Floats) -> None:
    """Add the mean over patches: values (pictures, patches), of which those count that every picture has."""
    common = np.isfinite(values).all(axis=0)
    found[:, NAMES.index(name), 0] += values[:, common].sum(axis=1)
    found[:, NAMES.index(name), 1] += common.sum()


def _task(name: str, shares: Floats) -> Task:
    """shares: (recording, before, after; blocks, 2) sums and weights of one figure."""
    values, left_out = _ratio(shares.sum(axis=1)), _left_out(shares)
    intervals = {}
    for column, label in enumerate(("recording", "before", "after")):
        intervals[label] = _interval(values[column], left_out[column])
    for column, label in enumerate(("before_off", "after_off"), 1):
        intervals[label] = _interval(values[column] - values[0], left_out[column] - left_out[0])
    figure = FIGURES[name]
    recording, before, after = (rounded(float(value)) if np.isfinite(value) else None for value in values)
    return Task(
        name=name,
        unit=figure.unit,
        recording=recording,
        before=before,
        after=after,
        ci95={label: rounded(ends) for label, ends in intervals.items() if ends is not None},
        reason="" if np.isfinite(values).all() else figure.none,
    )


def _ratio(shares: Floats) -> Floats:
    """(...) of (..., 2): sum over weight, NaN without weight."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.where(shares[..., 1] > 0, shares[..., 0] / shares[..., 1], np.nan))


def _left_out(shares: Floats) -> Floats:
    """(3, blocks) the figure without each block, of those that have anything to say of it."""
    telling = (shares[:, :, 1] > 0).any(axis=0)
    return _ratio(shares.sum(axis=1, keepdims=True) - shares[:, telling])


def _interval(value: float, left_out: Floats) -> tuple[float, float] | None:
    """The 95 % interval; none of fewer than three blocks."""
    if not np.isfinite(value) or len(left_out) < 3 or not np.isfinite(left_out).all():
        return None
    half = float(jackknife_half(left_out))
    return float(value - half), float(value + half)
