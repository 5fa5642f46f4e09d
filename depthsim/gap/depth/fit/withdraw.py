"""Causes that are withdrawn after the selection, by frames that it has not seen or by the gap as a whole."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.evidence import biases_of
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.fit.agreement import is_uniform, left_along, left_of_change
from depthsim.gap.depth.fit.asked import WORDS
from depthsim.gap.depth.fit.changes import KINDS, against, has_effect
from depthsim.gap.depth.fit.intervals import parameter_intervals
from depthsim.gap.depth.fit.itself import takes_what_is_filled
from depthsim.gap.depth.fit.marks import only_its_own
from depthsim.gap.depth.fit.pairs import PLACES
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.shapley import credit
from depthsim.gap.depth.fit.validate import Score, Validator, closed_error
from depthsim.gap.diagnosis import Cut, Nearest
from depthsim.gap.selection import Refused, closes_enough_alone
from depthsim.sensor.effect import Effect, effect_class
from depthsim.sensor.effects.extrinsics import ExtrinsicRotation, ExtrinsicTranslation, TimeOffset
from depthsim.sensor.parameter import learned_of, parameters_of

_LINES = {"image_column", "image_row"}
_NEIGHBOURS = {"pixel_neighbours", "frame_neighbours"}


def unsupported(validator: Validator, selecting: Validator, selection: Selection) -> Selection:
    """Without the causes that the frames that are reported on do not support.

    Without them no more is left there, or what they close is unknown by more than the whole gap, or next to nothing.
    """
    base, model = validator.evidence.base, selection.model
    start, full = (validator, base), (validator, model.build(base))
    whole = max(validator.score(base).above, 1e-12)
    faint = validator.config.faint * validator.score(full[1]).floor / whole
    for number in reversed(range(len(model.parts))):
        less = validator, model.less(number).build(base)
        closes = (validator.quick(less[1]) - validator.quick(full[1])) / whole
        # What begins late, or is seen in few frames, closes nothing in others.
        if closes > 0 and (
            closed_error(start, less, full) <= max(validator.config.unknown, closes)
            or _harms_none(validator, less[1], full[1])
        ):
            if closes >= faint or _shows_for_sure(validator, selection, number):
                continue
            why = "closes next to nothing beside the others"
        else:
            why = "closes something on some frames, and on others nothing, or the opposite"
        selection = _less(selecting, selection, number, why)
    return selection


def left_by_poses(errors: PoseErrors, selecting: Validator, selection: Selection, gap: float) -> Selection:
    """Without what registered frames leave of the poses' errors. gap: with these, 0 where they are no cause.

    A turn or shift of the mount, or late stamps, that are no more than what random errors leave on average, what closes
    next to nothing of it, and what errors of the poses close as well that are no larger than what registering leaves.
    """
    left_alike = "by no more than the poses' errors leave on average"
    by_chance = {
        ExtrinsicRotation.id: (errors.turn_by_chance, f"turns the mount {left_alike}"),
        ExtrinsicTranslation.id: (errors.shift_by_chance, f"shifts the mount {left_alike}"),
        TimeOffset.id: (errors.late_by_chance, f"moves the stamps {left_alike}"),
    }
    for number, part in reversed([*enumerate(selection.model.parts)]):
        if part.effect in by_chance and _size(selection, number) < by_chance[part.effect][0]:
            why = by_chance[part.effect][1]
        elif _as_left_by_poses(errors, selecting, selection, number, gap) and not _shows_for_sure(
            selecting, selection, number
        ):
            why = "closes no more than what registering leaves of the poses' errors"
        else:
            continue
        selection = _less(selecting, selection, number, why)
    return selection


def _size(selection: Selection, number: int) -> float:
    """Of a cause's parameters together."""
    return float(np.linalg.norm([*selection.model.parameters(number).values()]))


def _as_left_by_poses(errors: PoseErrors, selecting: Validator, selection: Selection, number: int, gap: float) -> bool:
    """Whether one cause closes next to nothing of the ``gap``, or little of which most is closed by poses that are off
    by what registering leaves, one or two standard errors."""
    config, closes = selecting.evidence.config, _closes(selecting, selection, number)
    if closes < config.select.beside_poses * gap:
        return True
    if closes >= config.select.further * gap:
        return False
    less = selection.model.less(number).build(selecting.evidence.base)
    least = min(selecting.quick((*less, errors.left(times))) for times in (1, 2))
    return selecting.quick(less) - least >= config.agreement.mostly * closes


def left_by_biases(selecting: Validator, selection: Selection) -> Selection:
    """Without a little noise, everywhere or by materials, beside a bias: so looks what another formula's bias leaves.

    But for one that leaves next to nothing of how spreads change along its own axis, as what a bias leaves does not,
    unless it is the simulator's own noise at the depth that the biases make. While causes are looked for it stays: what
    took its place would be further from the truth.
    """
    causes = selection.model.effects
    most = selecting.evidence.config.select.further * selecting.score(selecting.evidence.base).above
    for number, cause in reversed([*enumerate(causes)]):
        everywhere = cause.kinds[0] == "spread" and cause.axes[:1] in (("range",), ("material",))
        if (
            everywhere
            and any(one.kinds[0] == "bias" for one in causes)
            and _closes(selecting, selection, number) < most
        ):
            why = "closes no more than what the formulas of the biases leave"
            if _is_whole(selecting, selection, number):
                if not _is_noise_there(selecting, selection, number):
                    continue
                why = "is the noise that there is, at the depth that the biases make"
            selection = _less(selecting, selection, number, why)
    return selection


def filled(selecting: Validator, selection: Selection) -> Selection:
    """Without fewer of the simulator's own holes beside what fills them, which by its own formula may do so.

    While causes are looked for they stay: beside them what fills holes is known, and not without.
    """
    base = selecting.evidence.base
    for number, cause in reversed([*enumerate(selection.model.effects)]):
        before, after = selection.model.less(number).build(base), selection.model.build(base)
        if (why := takes_what_is_filled(selecting, cause, before, after)) is not None:
            selection = _less(selecting, selection, number, why)
    return selection


def as_nothing(validator: Validator, selecting: Validator, selection: Selection) -> Selection:
    """Without the causes that the simulator has not, and that may do nothing, by the intervals of their parameters.

    A scale that is off by 0.04 %, give or take as much: it stood for what another cause did before all were there.
    """
    evidence, model = validator.evidence, selection.model
    asked = [number for number in range(len(model.parts)) if _may_be_nothing(selecting, selection, number)]
    intervals = parameter_intervals(evidence, validator.ruler, evidence.base, model) if asked else []
    for number in reversed(asked):
        known, own = parameters_of(model.effects[number]), intervals[number]
        strengths = [(own[name], known[name].neutral) for name in own.keys() & known.keys()]
        strengths = [(ends, nothing) for ends, nothing in strengths if nothing is not None]
        if strengths and all(low <= nothing <= high for (low, high), nothing in strengths):
            selection = _less(selecting, selection, number, "may as well do nothing, as far as its size is known")
    return selection


def _may_be_nothing(selecting: Validator, selection: Selection, number: int) -> bool:
    """Whether one cause is none of the simulator's, and has a strength that an interval may reach both sides of."""
    kind = selection.model.effects[number]
    signed = any(one.neutral is not None and one.scaled != "log" for one in parameters_of(kind).values())
    return (
        signed
        and not has_effect(selecting.evidence.base, kind.id)
        and not _shows_for_sure(selecting, selection, number)
    )


def cancelling(selecting: Validator, selection: Selection) -> Selection:
    """Without two biases, or two noises, that do nothing but cancel, if they leave some of the gap of that kind.

    Neither alone, as it is fitted beside the other, comes nearer to the recording than none. So are a camera and its
    mount that were calibrated together, which leave next to nothing; others come near to the shape of a third. So is
    noise by motion in the place of all other noise. But of a law that is only supposed there may be less.
    """
    model, base, supposed = selection.model, selecting.evidence.base, selecting.evidence.supposed
    own = [(k, one) for k, one in enumerate(model.effects) if one.id != supposed]
    formulas = [(k, one.kinds[0]) for k, one in own if not learned_of(one)]
    alike = [(k, i, kind) for (k, kind), (i, other) in combinations(formulas, 2) if kind == other]
    for one, other, kind in alike:
        if kind not in ("bias", "spread"):
            continue
        rest = model.less(other).less(one).build(base)
        without = selecting.quick(rest)
        alone = (model.parts[k].build(rest, model.split(model.x)[k]) for k in (one, other))
        if any(selecting.quick(effects) < without for effects in alone):
            continue
        gap, left = (selecting.once(against, x).whole[KINDS.index(kind)] for x in (rest, model.build(base)))
        if left > selecting.evidence.config.agreement.near_floor * gap:
            closes = (without - selecting.quick(model.build(base))) / 2
            for number, beside in ((other, one), (one, other)):  # the later one first, as those after it move up
                why = f"does nothing but cancel {model.parts[beside].effect}, and some of the {WORDS[kind]} are left"
                selection = _less(selecting, selection, number, why, closes)
            return cancelling(selecting, selection)
    return selection


def _is_whole(selecting: Validator, selection: Selection, number: int) -> bool:
    """Whether one cause leaves next to nothing of how errors of its kind change along its own axes."""
    model, base = selection.model, selecting.evidence.base
    along = left_along(selecting, model.effects[number], model.less(number).build(base), model.build(base))
    return along is not None and along <= selecting.evidence.config.agreement.near_floor


def _is_noise_there(selecting: Validator, selection: Selection, number: int) -> bool:
    """Whether one noise closes no more than the simulator's own does where its law is of the depth with the biases."""
    evidence, model = selecting.evidence, selection.model
    full, less = model.build(evidence.base), model.less(number).build(evidence.base)
    centred = evidence.centred(full, however_small=True)
    if centred is None:
        return False
    biases, runs = biases_of(full), evidence.config.fit.runs
    here, there = (Validator(one, selecting.blocks) for one in (centred, centred.displaced()))
    with_it = here.quick(full, runs)
    closes = here.quick(less, runs) - with_it
    left = there.quick([one for one in less if one not in biases], runs) - with_it
    return left <= evidence.config.select.further_of_left * closes


def adding_nothing(validator: Validator, selecting: Validator, selection: Selection, given: Validator) -> Selection:
    """Without the causes that close nothing beside the poses' errors. given: the frames before they were registered."""
    while selection.model.parts:
        shares = credit(validator, validator.evidence.base, selection.model, given)[:-1]
        least = int(np.argmin(shares))
        if shares[least] > 0:
            break
        selection = _less(selecting, selection, least, "closes nothing beside the poses' errors")
    return selection


def acting_elsewhere(
    validator: Validator, selection: Selection, before: Score, closed: float, where: Sequence[Cut]
) -> Selection:
    """Without causes, but those that show for sure, where none acts along the axis on which the gap lies first, and
    much of it is left there.

    before, where: how large the gap is and where it lies; closed: the share that the causes close.
    """
    first = _first(where, selection)
    if first is None:
        return selection
    shares = credit(validator, validator.evidence.base, selection.model)
    if not _acts_elsewhere(selection, shares, first):
        return selection
    limit, causes = validator.evidence.config.agreement, selection.model.effects
    along_own = _along_own(selection, first, where)
    if along_own > first.share_of_gap:  # the other one comes first by how few cells it has
        return selection
    # Geometry, which has no other formula, has been asked for all biases that it leaves along its own axes.
    asked = first.what == "bias" and all(one.exact for one in causes if one.kinds[0] == "bias")
    as_much = along_own >= limit.as_much * first.share_of_gap
    none_left = closed >= limit.well and not _is_left(validator, selection, first)
    most = limit.well if asked or (as_much and none_left) else limit.nearly_all
    if closed >= most and (as_much or none_left):
        return selection
    # What is lost or smoothed anywhere: of a gap that is the same all over, an axis comes first by chance.
    anywhere = any(first.what in one.kinds and (not one.axes or one.kinds[0] == "correlation") for one in causes)
    if anywhere and closed >= 1 - limit.near_floor:
        same = is_uniform(validator, first.axis, first.what, validator.evidence.base)
        if same or not _is_left(validator, selection, first):
            return selection
    why = f"does not act along {first.axis.replace('_', ' ')}, on which the gap lies first"
    return _refused(validator, selection, before, shares, why)


def is_for_another(selection: Selection, where: Sequence[Cut]) -> bool:
    """Whether the gap lies first along an axis by which another of the effects that came first is known."""
    first = _first(where, selection)
    causes = {part.effect for part in selection.model.parts}
    others = (trial.newest.effect for step in selection.looked_at[:1] for trial in step)
    known = (effect_class(name) for name in others if name not in causes)
    return first is not None and any(first.what in one.kinds and first.names & {*one.axes[:1]} for one in known)


def little(selecting: Validator, selection: Selection) -> Selection:
    """Without the only cause that is left, if it closes too little for a first one: what it was found beside is none.

    But for what makes steps, doubled rows or tiles.
    """
    if len(selection.model.parts) != 1 or _shows_for_sure(selecting, selection, 0):
        return selection
    base, cause = selecting.evidence.base, selection.model.effects[0]
    before, after = selecting.quick(base), selecting.score(selection.model.build(base))
    floor = after.floor if cause.kinds[0] == "correlation" else selecting.score(base).floor
    first = (trial for step in selection.looked_at[:1] for trial in step)
    most = max((before - one.gap for one in first if one.newest.effect != cause.id), default=0.0)
    gained = _closes(selecting, selection, 0)
    if closes_enough_alone(gained, most, before - floor, selecting.evidence.config.select):
        return selection
    return _less(selecting, selection, 0, "closes too little by itself")


def _closes(selecting: Validator, selection: Selection, number: int) -> float:
    """What one cause closes on top of the others."""
    model, base = selection.model, selecting.evidence.base
    return selecting.quick(model.less(number).build(base)) - selecting.quick(model.build(base))


def _shows_for_sure(selecting: Validator, selection: Selection, number: int) -> bool:
    """Whether one cause makes the recording's steps, doubled rows or tiles, which no other error does."""
    model, base = selection.model, selecting.evidence.base
    change = effect_class(model.parts[number].effect), model.less(number).build(base), model.build(base)
    return only_its_own(selecting, *change)


def _less(selecting: Validator, selection: Selection, number: int, why: str, closes: float | None = None) -> Selection:
    """The selection without one of its causes, which is kept as what comes near.

    closes: by default what it does on top of the others.
    """
    whole = max(selecting.quick(selecting.evidence.base), 1e-12)
    share = (_closes(selecting, selection, number) if closes is None else closes) / whole
    near = Nearest(effect=selection.model.parts[number].effect, closed_fraction=share, why_not=why)
    return replace(selection, model=selection.model.less(number), nearest=(*selection.nearest, near))


def _acts_elsewhere(selection: Selection, shares: Sequence[float], first: Cut) -> bool:
    """Whether no cause acts along the axis on which the gap lies first.

    Where most is closed by causes that make that kind of error first, of these: a noise that changes along an axis says
    nothing of holes that do. Tails do not count: they are in few pixels, and most of what these change elsewhere is
    chance. What makes neighbours go together also changes how successive frames do. shares: what each closes.
    """
    causes = selection.model.effects
    of_kind = [one.kinds[0] == first.what for one in causes]
    if np.sum(shares, where=of_kind) > 0.5 * np.sum(shares):
        causes = [one for one, is_one in zip(causes, of_kind, strict=True) if is_one]
    if first.what == "tail" and any("tail" in one.kinds for one in causes):
        return False
    along, kinds = first.names, {"tail", first.what} & {"tail", "correlation"}
    # Biases are in units of the simulator's spread, of which each material has its own.
    if first.what == "bias" and "material" in along:
        along |= {"range"}
    return bool(causes) and not any(along & set(one.axes) or one.kinds[0] in kinds for one in causes)


def _first(where: Sequence[Cut], selection: Selection) -> Cut | None:
    """Where the gap lies first, but for places: where the camera hardly moves, whatever is in a scene has one.

    Unless a cause of that kind is known by them. Rows or columns that come after a place in the picture are where that
    is. Where the camera stands still every axis is one of places. That holes go together says what they are, and not
    where; of causes that make holes alone where these are is asked.
    """
    causes = selection.model.effects
    of_holes = [cut for cut in where if cut.what == "missing"]
    where = of_holes if of_holes and all(one.kinds == ("missing",) for one in causes) else where
    places = PLACES if where and where[0].axis == "image_position" else PLACES - _LINES

    def is_place(cut: Cut) -> bool:
        known_by = {name for one in causes if cut.what in one.kinds for name in one.axes[:1]}
        return bool((places - known_by) & cut.names) or (cut.what == "missing" and cut.axis in _NEIGHBOURS)

    return next((cut for cut in where if not is_place(cut)), where[0] if where else None)


def _along_own(selection: Selection, first: Cut, where: Sequence[Cut]) -> float:
    """Most of the gap that an axis of a cause's own explains, of the kind of error of ``first``."""
    own = {name for one in selection.model.effects for name in one.axes}
    return max((cut.share_of_gap for cut in where if cut.what == first.what and cut.names <= own), default=0.0)


def _is_left(validator: Validator, selection: Selection, first: Cut) -> bool:
    """Whether the causes leave so much that they had to act where the gap lies first."""
    limit, base = validator.evidence.config.agreement, validator.evidence.base
    return left_of_change(validator, first.axis, first.what, base, selection.model.build(base)) > limit.near_floor


def unsure(validator: Validator, selection: Selection, before: Score) -> Selection:
    """Without causes, but those that show for sure, where frames differ so much that together they may close nothing.

    Of few blocks an interval is wide: they stay if they make it larger in none.
    """
    base = validator.evidence.base
    if _harms_none(validator, base, selection.model.build(base)):
        return selection
    shares = credit(validator, base, selection.model)
    return _refused(validator, selection, before, shares, "closes something on some frames, and on others nothing")


def _harms_none(validator: Validator, less: Sequence[Effect], full: Sequence[Effect]) -> bool:
    """Whether a cause that ``full`` has and ``less`` has not makes the gap larger in no block of frames, or hardly so:
    by little of what it closes on average.
    """
    closes = _by_block(validator, less) - _by_block(validator, full)
    return bool(closes.min() >= -validator.evidence.config.select.harms * closes.mean())


def _by_block(validator: Validator, effects: Sequence[Effect]) -> NDArray[np.float64]:
    """(blocks,) the gap of a sensor in each block of frames."""
    runs = validator.runs(effects, validator.config.runs_resampled)
    gaps = [[validator.ruler.gap(real, run[k]) for run in runs] for k, real in enumerate(validator.real)]
    return np.mean(gaps, axis=1)


def _refused(validator: Validator, selection: Selection, before: Score, shares: Sequence[float], why: str) -> Selection:
    """Only the causes that show for sure; the others are kept as what comes near. shares: what each of them closes."""
    refused, model = Refused({near.effect: near for near in selection.nearest}), selection.model
    for number, share in reversed([*enumerate(shares)]):
        if not _shows_for_sure(validator, selection, number):
            refused.refuse(model.parts[number].effect, share / max(before.above, 1e-12), why)
            model = model.less(number)
    named = [part.effect for part in model.parts]
    nearest = refused.nearest(named, validator.evidence.config.select)
    ties = {cause: equals for cause, equals in selection.ties.items() if cause in named}
    return replace(selection, model=model, nearest=nearest, ties=ties)
