"""Marks that pictures have of some effects alone: steps, doubled rows, holes and outliers in lines, waves, seams,
neighbours alike, errors that stay at their pixels, in the scene or in a frame, and pixels that an effect changes by
itself."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import Seed
from depthsim.gap.depth.data.doubling import line_of
from depthsim.gap.depth.data.lines import far_off, in_lines
from depthsim.gap.depth.data.locked import SeenAgain, carried_share, locked_share, seen_again
from depthsim.gap.depth.data.quantization import find_steps
from depthsim.gap.depth.data.tiles import find_tiles
from depthsim.gap.depth.data.waves import strongest_seam, strongest_wave
from depthsim.gap.depth.fit import neighbours
from depthsim.gap.depth.fit.changes import Effects, phases_apart
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effect import Effect, physical_order

_WIDEST = 3
"""[px] The widest lines of outliers: a beam that sweeps the picture disturbs some rows at once. Holes behind edges are
as wide, and are asked for single lines."""


def only_its_own(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether ``effect`` makes steps, doubled rows or tiles that the recording has, as no other error does."""
    made = (makes_steps, makes_doubling, makes_tiles)
    return any(makes(validator, effect, before, after) for makes in made)


def makes_steps(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether ``effect`` makes steps: disparities of ``after`` lie on the recording's, those of ``before`` do not.

    What loses the far pixels, of which alone steps are seen, makes none.
    """
    if validator.evidence.cuts.own_steps is None or effect.axes[:1] != ("disparity_phase",):
        return False
    gap, left = validator.once(phases_apart, before), validator.once(phases_apart, after)
    axis = int(np.argmax(gap))
    limit = validator.evidence.config.agreement
    return bool(gap[axis] > limit.steps and left[axis] < limit.left_along * gap[axis])


def makes_doubling(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether ``effect`` makes the recording's doubled rows: pictures of ``after`` have their lines, of ``before`` not.

    Steps of a depth with little noise make lines, too, on a tilted plane: of a sensor that has them ``before`` as well.
    """
    if not effect.moves_camera or validator.evidence.doubled is None:
        return False
    least = validator.evidence.config.agreement.left_along * validator.once(_line_recorded)
    without, with_it = (validator.once(_line_simulated, effects) for effects in (before, after))
    return without < least <= with_it


def makes_tiles(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> bool:
    """Whether ``effect`` makes the recording's tiles: pictures of ``after`` have them, of ``before`` none."""
    tiled = validator.evidence.tiled
    if tiled is None or not effect.resizes() or effect.moves_camera:
        return False
    return tiled == validator.once(_tiles, after) != validator.once(_tiles, before)


def unseen_step(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether an effect puts the disparities on steps, where those of the recording lie on none.

    A bias that goes up and down with the disparity brings them near steps, too, but does not round them.
    """
    steps = effect.axes[:1] == ("disparity_phase",) and effect.kinds[0] != "bias"
    if not steps or validator.evidence.cuts.own_steps is not None:
        return None
    step = validator.once(_step, after)
    if step is None or validator.once(_step, before) is not None:
        return None
    return f"makes steps of {step:.3g} px, and the recording has none"


def come_in_lines(validator: Validator, effect: type[Effect], after: Effects) -> str | None:
    """Whether an effect loses or misplaces pixels anywhere, one by one, and the recording's come in rows or columns."""
    kind, limit = effect.kinds[0], validator.evidence.config.agreement
    most = {"missing": limit.in_lines, "tail": limit.outliers_in_lines}.get(kind)
    if effect.axes not in ((), ("residual_tail",)) or most is None:
        return None
    usual = max(validator.once(_lines_simulated, after)[kind], 1.0)
    if validator.once(_lines_recorded)[kind] <= most * usual:
        return None
    does, what = ("loses", "holes") if kind == "missing" else ("misplaces", "outliers")
    return f"{does} pixels one by one, and the recording's {what} come in rows or columns"


def brings_together(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether a filter makes neighbours go together that do not in the recording, for the spread that it takes away.

    Or as much as they did without it: a filter that hardly filters, for what a noise leaves by its formula.
    """
    known = effect.axes[0] if effect.axes else ""
    if effect.kinds[0] != "correlation" or known not in neighbours.HISTOGRAMS:
        return None
    limit, brought = validator.evidence.config.agreement, neighbours.brought(validator, known, before, after)
    along = known.replace("_", " ")
    if brought > limit.brought_together:
        return f"makes errors go together along {along}, where the recording's do not"
    nearer = limit.brought_nearer * min(neighbours.apart(validator, known), 1.0)
    if "spread" in effect.kinds and brought > -nearer:
        return f"takes spread away, and makes errors go together along {along} no better than they did"
    return None


def acts_on_another(validator: Validator, effect: type[Effect], before: Effects, after: Effects) -> str | None:
    """Whether holes or tails are made of what another cause makes, and next to none by the effect alone.

    Such as a largest range for false matches that lie no farther: that is another formula of the other cause. Filling
    is of holes, whose ever they are.
    """
    base = validator.evidence.base
    own = [one for one in after if one.id == effect.id and one not in before]
    if effect.kinds[0] not in ("missing", "tail") or effect.seen_on or not own or tuple(before) == base:
        return None
    # A filter that acts later carries on what the effect makes, and makes none itself.
    earlier = tuple(one for one in before if physical_order(one) <= physical_order(own[0]))
    by_itself, beside = (
        validator.once(_pixels_changed, others, (*(one for one in others if one.id != effect.id), *own))
        for others in (base, earlier)
    )
    if by_itself >= validator.evidence.config.agreement.by_itself * beside:
        return None
    return f"changes what other causes make, and by itself {by_itself / beside:.0%} of as many pixels"


def comes_in_waves(validator: Validator, effect: type[Effect], after: Effects) -> str | None:
    """Whether a noise, or what makes noise go together, is for errors that come in waves, as no effect makes them.

    Such as stripes that move, or even and odd columns, whose errors are no larger than those of a noise.
    """
    length = waves_beside(validator, after) if effect.kinds[0] in ("spread", "correlation") else None
    return None if length is None else f"makes no waves, and the recording's errors have some of {length:.3g} px"


def breaks_at_seams(validator: Validator, effect: type[Effect], after: Effects) -> str | None:
    """Whether a noise, or what makes noise go together, is for errors that go together in blocks of pixels alone.

    Such as those that a lossy codec leaves, which look smoothed.
    """
    side = seams_beside(validator, after) if effect.kinds[0] in ("spread", "correlation") else None
    return None if side is None else f"makes no seams, and the recording's errors break every {side} columns"


def stays_at_pixels(validator: Validator, effect: type[Effect], after: Effects) -> str | None:
    """Whether a noise, or what makes neighbours go together, is for errors that are locked to the pixel.

    Not what makes frames go together: that may last longer in the recording than by its formula.
    """
    if effect.kinds[0] not in ("spread", "correlation") or effect.axes[:1] == ("frame_neighbours",):
        return None
    recorded, simulated = validator.once(_held_recorded), validator.once(_held_simulated, after)
    if recorded.locked <= simulated.locked + validator.evidence.config.agreement.locked:
        return None
    return "makes errors anew in every frame, and the recording's stay at their pixels"


def shifts_by_frame(validator: Validator, effect: type[Effect], after: Effects) -> str | None:
    """Whether a noise, or what makes noise go together, is for errors by which whole frames are off, each by another.

    Such as depth that is nearer while the camera turns to the left, as where its two imagers are exposed one after the
    other: over all frames that is spread, which grows with the motion.
    """
    if effect.kinds[0] not in ("spread", "correlation"):
        return None
    recorded, simulated = validator.once(_held_recorded), validator.once(_held_simulated, after)
    if recorded.shifted <= simulated.shifted + validator.evidence.config.agreement.shifted:
        return None
    return "makes errors pixel by pixel, and the recording's frames are off as a whole, each by another"


def stays_in_scene(validator: Validator, effect: type[Effect], after: Effects) -> str | None:
    """Whether a noise, or what makes noise go together, is for errors that surfaces carry with them over the picture.

    Such as those of a texture, or of the scene itself.
    """
    if effect.kinds[0] not in ("spread", "correlation") or not is_carried(validator, after):
        return None
    return "makes errors anew in every frame, and the recording's stay at their places in the scene"


def is_carried(validator: Validator, effects: Effects) -> bool:
    """Whether the recording's errors stay at their places in the scene more than those of a sensor."""
    recorded, simulated = validator.once(_held_recorded), validator.once(_held_simulated, effects)
    return recorded.carried > simulated.carried + validator.evidence.config.agreement.locked


def waves_beside(validator: Validator, effects: Effects) -> float | None:
    """The length [px] of waves of errors that the recording has and a sensor has not; None where there are none."""
    if _is_resampled(validator):
        return None
    (recorded, length), (simulated, _) = (
        validator.once(_held_recorded).wave,
        validator.once(_held_simulated, effects).wave,
    )
    return length if recorded > validator.evidence.config.agreement.waves * simulated else None


def seams_beside(validator: Validator, effects: Effects) -> int | None:
    """The width [px] of blocks of which the recording's errors show the seams, and a sensor's do not; None without."""
    if _is_resampled(validator):
        return None
    (recorded, side), (simulated, _) = (
        validator.once(_held_recorded).seam,
        validator.once(_held_simulated, effects).seam,
    )
    return side if recorded > simulated + validator.evidence.config.agreement.seams else None


def _is_resampled(validator: Validator) -> bool:
    """Whether rows and columns may be doubled: they come in waves, too, and a column agrees with itself."""
    return validator.evidence.camera.aligned or validator.evidence.doubled is not None


def _pixels_changed(validator: Validator, before: Effects, after: Effects) -> float:
    """The share of the pixels that are others by two sensors, of the same random numbers."""
    seed = Seed("changed")
    shown = (
        zip(*(validator.evidence.pictures(e, b, seed) for e in (before, after)), strict=True) for b in validator.few
    )
    return float(np.mean([(one != other).mean() for pairs in shown for one, other in pairs]))


def _line_recorded(validator: Validator) -> float:
    """How strong the lines of the doubled rows are in some of the recording's pictures."""
    evidence = validator.evidence
    return line_of((evidence.recorded(int(i)) for b in validator.few for i in evidence.blocks[b]), _doubled(validator))


def _line_simulated(validator: Validator, effects: Effects) -> float:
    """How strong the lines of the recording's doubled rows are in the same pictures of a sensor."""
    shown = (validator.evidence.pictures(effects, b, Seed("doubling")) for b in validator.few)
    return line_of((picture for pictures in shown for picture in pictures), _doubled(validator))


def _doubled(validator: Validator) -> tuple[float, float]:
    assert validator.evidence.doubled is not None
    return validator.evidence.doubled


def _step(validator: Validator, effects: Effects) -> float | None:
    """The step of the disparities that a sensor shows [px]."""
    evidence = validator.evidence
    shown = (
        (evidence.pictures(effects, b, Seed("steps"))[0], evidence.frames[int(evidence.blocks[b][0])].geometry.depth)
        for b in validator.few
    )
    found = find_steps(evidence.camera, shown, evidence.config.data)
    return found[0] if found else None


def _tiles(validator: Validator, effects: Effects) -> int | None:
    """The side of the tiles that a sensor shows [px]."""
    return find_tiles(validator.evidence.pictures(effects, b, Seed("tiles"))[0] for b in validator.few)


def _lines_recorded(validator: Validator) -> dict[str, float]:
    return _lines(validator, (validator.evidence.recorded(i) for i in validator.once(_surfaces)))


def _lines_simulated(validator: Validator, effects: Effects) -> dict[str, float]:
    shown = (validator.evidence.pictures(effects, b, Seed("lines")) for b in validator.few)
    return _lines(validator, (picture for pictures in shown for picture in pictures))


def _lines(validator: Validator, pictures: Iterable[NDArray[np.uint16]]) -> dict[str, float]:
    """How far holes and outliers come in lines, see :func:`in_lines`, by the kind of error."""
    evidence, holes, outliers = validator.evidence, [], []
    for (i, surface), units in zip(validator.once(_surfaces).items(), pictures, strict=True):
        there, clean = surface & (units > 0), evidence.frames[i].geometry.depth.astype(np.float64)
        depth = units.astype(np.float64) * evidence.camera.depth_scale
        holes.append((units == 0, surface))
        outliers.append((far_off(depth, clean, there), there))
    return {"missing": in_lines(holes), "tail": in_lines(outliers, _WIDEST)}


def _surfaces(validator: Validator) -> dict[int, NDArray[np.bool_]]:
    """(rows, width) of some frames, by their numbers: where a surface is seen, and the scene may be trusted."""
    evidence = validator.evidence
    some = (int(i) for b in validator.few for i in evidence.blocks[b])
    trusted = {i: evidence.trusted(i) for i in some}
    seen = {i: evidence.frames[i].geometry.depth > 0 for i in trusted}
    return {i: seen[i] if mask is None else seen[i] & mask for i, mask in trusted.items()}


class _Held(NamedTuple):
    """What holds errors where they are: waves and seams, see :func:`strongest_wave` and :func:`strongest_seam`, their
    pixels, and their places in the scene.

    And shifted: the standard deviation of the frames' mean signs. All of one look at the pictures, which take longer to
    simulate than to be looked at.
    """

    wave: tuple[float, float]
    seam: tuple[float, int]
    locked: float
    carried: float
    shifted: float


def _held_recorded(validator: Validator) -> _Held:
    return _held(validator, (validator.evidence.recorded(i) for i in validator.once(_surfaces)))


def _held_simulated(validator: Validator, effects: Effects) -> _Held:
    shown = (validator.evidence.pictures(effects, b, Seed("waves")) for b in validator.few)
    return _held(validator, (picture for pictures in shown for picture in pictures))


def _held(validator: Validator, pictures: Iterable[NDArray[np.uint16]]) -> _Held:
    signs = list(_signs(validator, pictures))
    locked = locked_share(_far_apart(validator, signs))
    carried = carried_share(signs, validator.once(_seen_again))
    sides = [float(one[one != 0].mean()) for one in signs if one.any()]
    return _Held(strongest_wave(signs), strongest_seam(signs), locked, carried, float(np.std(sides or [0.0])))


def _seen_again(validator: Validator) -> list[SeenAgain]:
    return seen_again([validator.evidence.frames[i] for i in validator.once(_surfaces)])


def _far_apart(validator: Validator, frames: Iterable[NDArray[np.int8]]) -> list[NDArray[np.int8]]:
    """Of the frames of :attr:`Validator.few` the earliest and the latest: no noise lasts from one to the other."""
    shown = dict(zip(validator.once(_surfaces), frames, strict=True))
    return [shown[i] for i in sorted({min(shown), max(shown)})]


def _signs(validator: Validator, pictures: Iterable[NDArray[np.uint16]]) -> Iterator[NDArray[np.int8]]:
    """The side of the scene to which the pixels of some frames are off, 0 where that is not known."""
    frames, unit = validator.evidence.frames, validator.evidence.camera.depth_scale
    for (i, surface), units in zip(validator.once(_surfaces).items(), pictures, strict=True):
        error = units * unit - frames[i].geometry.depth
        yield np.where(surface & (units > 0), np.sign(error), 0).astype(np.int8)
