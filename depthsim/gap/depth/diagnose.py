"""The diagnosis of a depth sensor's sim-to-real gap, from a run folder alone.

is there a gap   how far recording and simulation are apart, and how far two runs of one sensor would be
which            the effects that explain it, each fitted on some blocks of frames and validated on the others
how far          the gap again with the causes added
where            the axes along which it lies, before and after; what lies there after is unexplained
what it costs    the figures that a robot's software sees, of the recording and of the simulator before and after
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.divergence import MEASURE, UNIT
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.load import load_evidence, notes_of
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.findings import Findings
from depthsim.gap.depth.fit import withdraw
from depthsim.gap.depth.fit.alignment import select_aligned
from depthsim.gap.depth.fit.candidates import Candidate, candidates, setting_of
from depthsim.gap.depth.fit.causes import causes_of, fixed_profile
from depthsim.gap.depth.fit.finer import with_fine_pattern
from depthsim.gap.depth.fit.marks import is_carried, waves_beside
from depthsim.gap.depth.fit.pattern import learn_pattern
from depthsim.gap.depth.fit.poses import (
    explained_as_given,
    is_for_what_lags,
    matter,
    no_poses,
    register_frames,
)
from depthsim.gap.depth.fit.select import Selection, select, select_more
from depthsim.gap.depth.fit.tiles import select_tiled
from depthsim.gap.depth.fit.unseen import in_words, unseen
from depthsim.gap.depth.fit.validate import Score, Validator, closed_error
from depthsim.gap.depth.tasks.measure import tasks_of
from depthsim.gap.depth.tasks.odometry import Odometry
from depthsim.gap.depth.where.localize import Place, cuts_of, locate
from depthsim.gap.depth.where.residual import unexplained_by
from depthsim.gap.diagnosis import Diagnosis, Gap, Unexplained
from depthsim.gap.report.folder import check_report_folder
from depthsim.gap.selection import verdict_of
from depthsim.materials import Materials
from depthsim.runs.folder import Run
from depthsim.scene import Scene
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.sensor.effects.align import AlignToColor
from depthsim.sensor.effects.decimation import Decimation
from depthsim.sensor.effects.fixed_pattern import FixedPattern
from depthsim.sensor.effects.pose_noise import PoseNoise
from depthsim.sensor.profile import Profile

if TYPE_CHECKING:
    from depthsim.gap.depth.report.write import Drawn

_CARRIED = (
    "the recording's errors stay at their places in the scene, and no simulated ones: its surfaces make them, or it is "
    "another scene there"
)
_FAINTLY = (
    "the recording differs from the simulator by more than chance, but by less than a tenth of what two runs of one "
    "sensor differ by, and no effect explains it"
)
Say = Callable[[str], None]


def diagnose(
    run: str | Path | Run,
    *,
    scene: str | Path | Scene | None = None,
    sensor: str | Path | Profile | Sequence[Effect] | None = None,
    out: str | Path | None = None,
    without: Sequence[str] = (),
    objects: Sequence[str] = (),
    without_objects: Sequence[str] = (),
    threads: int | None = None,
    materials: str | Path | Materials | None = None,
    config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
    say: Say = lambda _: None,
    tasks: bool = True,
) -> Diagnosis:
    """Where a recording and its simulation differ, which effects cause it, and how far they close the gap.

    run: the recording, as a folder or open. scene: where it was taken; the run's own if not given. sensor: the profile
    that is compared with it, or effects alone; the run's sensor.yaml, or ``paper``. out: a folder for diagnosis.json,
    sensor.yaml and index.html. without: effects that are left out of the bank. objects, without_objects: names of those
    that alone are looked at, and of those that are not, in a run with pictures of its objects. config: the thresholds.
    say: hears what is being done. tasks: whether to measure what the gap costs.

    Raises :class:`InputError` for a run, a scene or a profile that cannot be read, and where ``out`` holds other files
    than those of a report.
    """
    if out is not None:
        check_report_folder(Path(out))
    drawn: list[Drawn] = []

    def draw(found: Findings) -> None:
        if out is not None:
            from depthsim.gap.depth.report.write import Named, draw_report

            say("drawing the report")
            given = sensor if sensor is None or isinstance(sensor, str | Path) else found.profile
            file = Path(materials) if isinstance(materials, str | Path) else None
            drawn.append(draw_report(found, Path(out), Named(scene, given, file)))

    found = investigate(
        run, scene=scene, sensor=sensor, without=without, objects=objects, without_objects=without_objects,
        threads=threads, materials=materials, config=config, say=say, tasks=tasks, meanwhile=draw,
    )  # fmt: skip
    if out is not None:
        from depthsim.gap.depth.report.write import write_report

        write_report(found, Path(out), drawn=drawn[0])
        return found.diagnosis.in_report(out)
    return found.diagnosis


def investigate(
    run: str | Path | Run,
    *,
    scene: str | Path | Scene | None = None,
    sensor: str | Path | Profile | Sequence[Effect] | None = None,
    without: Sequence[str] = (),
    objects: Sequence[str] = (),
    without_objects: Sequence[str] = (),
    threads: int | None = None,
    materials: str | Path | Materials | None = None,
    config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
    say: Say = lambda _: None,
    tasks: bool = True,
    meanwhile: Callable[[Findings], None] = lambda _: None,
) -> Findings:
    """As :func:`diagnose`, with everything that the diagnosis was made from.

    meanwhile: is given it while odometry is still run, without what the gap costs there.
    """
    say("casting the scene")
    given, profile = load_evidence(run, scene, sensor, materials, threads, config, objects, without_objects)
    if not tasks:
        found = _found(given, profile, without, say)
        meanwhile(found)
        return found
    with Odometry(given) as odometry:
        odometry.begin(given.base, max(given.threads // 2, 1))  # on what the search leaves idle
        found = _found(given, profile, without, say)
        say("measuring what the gap costs")
        if found.diagnosis.causes:
            odometry.begin(found.fixed.effects, given.threads)
        odometry.hasten(given.threads)
        costs = tasks_of(found)
        meanwhile(found)
        say("running odometry on the recording and on its simulations")
        costs += odometry.tasks()
    return replace(found, diagnosis=found.diagnosis.model_copy(update={"tasks": costs}))


def _found(given: Evidence, profile: Profile, without: Sequence[str], say: Say) -> Findings:
    """What is found of a recording and the simulator's profile."""
    config = given.config
    if given.camera.aligned and any(isinstance(effect, AlignToColor) for effect in given.base):
        without = (*without, AlignToColor.id)
    if given.rows < given.camera.height:  # bands of rows are not resampled, and many frames before each cost as much
        bound = {name for name in effect_ids() if effect_class(name).resizes() or effect_class(name)().looks_back}
        without = (*without, *sorted(bound))

    # Is there a gap?
    say("measuring the gap")
    recorded, selecting = _parts(given)
    before = recorded.score(given.base)
    if not (before.stands_out(config.significance) or selecting.score(given.base).stands_out(config.significance)):
        return _no_gap(recorded, profile, before, *_blind(given, without))
    say("locating the gap")
    places = locate(given, recorded.ruler, given.base)
    where = cuts_of(given, given.base, places)
    if given.has_ray_lengths:  # whatever came near to that would be no cause
        without = effect_ids()

    # Are the poses off? All else is looked for on frames that are registered.
    validator, poses, errors = recorded, None, None
    if PoseNoise.id not in without:
        say("registering the frames")
        errors, poses = register_frames(given)
        if poses is not None:
            registered = _parts(poses.evidence)
            lags = partial(is_for_what_lags, given, errors, selecting.blocks, without, say)
            if not poses.bring_nearer(recorded, registered[0]) or lags():
                poses = None
            else:
                given.forget(given.test)
                validator, selecting = registered
    evidence = validator.evidence

    # Which effects explain it?
    bank = _bank(evidence, without, errors)
    selection = _which(selecting, bank, without, errors, say)
    if poses is not None and (as_it_is := explained_as_given(given, selecting, selection, say)) is not None:
        poses.evidence.forget(())  # most of what is kept in memory
        (validator, selecting), evidence, poses = _parts(as_it_is), as_it_is, None
        recorded, bank = validator, _bank(evidence, without, errors)
        selection = _which(selecting, bank, without, errors, say)
    found = selection.model.build(evidence.base)
    centred = evidence.centred(found) if selection.model.parts else None
    if centred is not None and (finer := with_fine_pattern(selecting, selection, say)) is not selection:
        selection = finer  # what a smooth pattern leaves of a large one would hide as much
        found = selection.model.build(evidence.base)
        centred = evidence.centred(found, however_small=True)
    drawn = validator  # as it is: errors are told from the scene's depth
    if centred is not None:
        say("looking behind the biases")
        own = _parts(centred)
        if more := select_more(own[1], bank, selection, say):
            selection = more
            # Before and after are measured from the same depth, also where the frames were registered between.
            if recorded is validator:
                recorded = own[0]
            elif moved := given.centred(found, however_small=True):
                recorded = Validator(moved, given.test)
            before = recorded.score(recorded.evidence.base)
            (validator, selecting), evidence = own, centred
    if validator is not selecting:
        selection = withdraw.unsupported(validator, selecting, selection)
    selection = withdraw.cancelling(selecting, selection)
    selection = withdraw.left_by_biases(selecting, selection)
    selection = with_fine_pattern(selecting, selection, say)
    is_cause = poses is not None and not poses.are_as_held and matter(recorded, validator, selection)
    if poses is not None:
        selection = withdraw.left_by_poses(poses.errors, selecting, selection, before.above if is_cause else 0.0)
    if is_cause:
        selection = withdraw.adding_nothing(validator, selecting, selection, recorded)
        # Where the frames differ so much that all together may close nothing, what closes least is not for the poses.
        is_cause = _how_far(recorded, validator, selection, before)[1].ci95[0] > 0
    if not is_cause and recorded is not validator:
        recorded, before = validator, validator.score(evidence.base)
    named = bool(selection.model.parts) or is_cause
    length = waves_beside(validator, selection.model.build(evidence.base))
    waves = f"the recording's errors come in waves of {length:.3g} px, and no simulated ones" if length else ""
    carried = _CARRIED if is_carried(validator, selection.model.build(evidence.base)) else ""
    said = poses.note(is_cause) if poses else "" if named else no_poses(errors)
    remarks = (
        *filter(None, (said, waves, carried)),
        *_blind(evidence, (*without, *(c.effect for c in selection.model.parts))),
    )
    if not named and not before.stands_out(config.significance) and poses is not None:
        return _no_gap(recorded, profile, before, *remarks)
    if not named and before.above < config.significance.faint * before.floor:
        return _no_gap(recorded, profile, before, *remarks, _FAINTLY)

    # How far do they close it?
    after, gap = _how_far(recorded, validator, selection, before)
    if selection.model.parts and not is_cause and not evidence.stands_still:
        kept = withdraw.acting_elsewhere(validator, selection, before, gap.closed_fraction, where)
        if kept.model.parts and gap.ci95[0] <= 0:
            kept = withdraw.unsure(validator, kept, before)
        if kept is not selection:
            selection, named = kept, bool(kept.model.parts)
            after, gap = _how_far(recorded, validator, selection, before)

    # Where is the rest?
    say("locating what is left")
    places_after, unexplained = _left(validator, selection, places, after, gap.closed_fraction, named)

    as_given, errors = (recorded, errors) if is_cause else (None, None)
    drawn = recorded if is_cause else drawn
    diagnosis = Diagnosis(
        verdict=verdict_of(named, unexplained),
        gap=gap,
        where=where,
        causes=causes_of(validator, selection, before.gap - after.floor, as_given, errors),
        unexplained=unexplained,
        notes=(*notes_of(evidence), *remarks),
    )
    fixed = (*selection.model.build(evidence.base), *(() if poses is None else poses.effects(is_cause)))
    return Findings(
        diagnosis, drawn.evidence, drawn, profile, fixed_profile(profile, fixed), before, after, selection,
        places, places_after,
    )  # fmt: skip


def _parts(evidence: Evidence) -> tuple[Validator, Validator]:
    """The frames that are reported on, and those that causes are selected on."""
    reported = Validator(evidence, evidence.test)
    return reported, Validator(evidence, evidence.held_out) if evidence.in_three else reported


def _blind(evidence: Evidence, without: Sequence[str]) -> tuple[str, ...]:
    """A note on the effects that this recording cannot show."""
    names = unseen(evidence, without)
    return (in_words(names),) if names else ()


def _no_gap(validator: Validator, profile: Profile, before: Score, *notes: str) -> Findings:
    """What is found where there is no gap."""
    gap = _gap(before, before, 0.0, 0.0)
    notes = (*notes_of(validator.evidence), *notes)
    diagnosis = Diagnosis(verdict="no_gap", gap=gap, where=(), causes=(), unexplained=None, notes=notes)
    return Findings(diagnosis, validator.evidence, validator, profile, profile, before, before, None, [], [])


def _which(
    validator: Validator, bank: Sequence[Candidate], without: Sequence[str], errors: PoseErrors | None, say: Say
) -> Selection:
    """The effects that explain the gap, of the bank. without: those that are not in it; errors: of the poses."""

    def beside(known: str, resampled: Evidence) -> Selection:
        less = (*without, known)
        return _which(_parts(resampled)[1], _bank(resampled, less, errors), less, errors, say)

    evidence = validator.evidence
    return (
        select_tiled(evidence, validator, bank, partial(beside, Decimation.id), say)
        or select_aligned(evidence, validator, bank, partial(beside, AlignToColor.id), say)
        or select(evidence, validator, bank, say)
    )


def _bank(evidence: Evidence, without: Sequence[str], errors: PoseErrors | None) -> list[Candidate]:
    """All that may be wrong with the simulator. errors: of the poses."""
    if not any(isinstance(effect, PoseNoise) for effect in evidence.base):
        # Registration is the better test of the poses: what it does not find, no fit of their spread may.
        without = (*without, PoseNoise.id)
    learned = {}
    if FixedPattern.id not in without and (patterns := learn_pattern(evidence)):
        learned[FixedPattern.id] = [pattern.effect().model_dump() for pattern in patterns]
    return candidates(evidence.base, setting_of(evidence, learned, errors), without, evidence.config.fit)


def _how_far(recorded: Validator, validator: Validator, selection: Selection, before: Score) -> tuple[Score, Gap]:
    """The gap with the causes added: measured again, as before, on frames that nothing was fitted on.

    recorded: the frames as they were, validator: as they are registered; the same where that is no cause.
    """
    if not selection.model.parts and recorded is validator:
        return before, _gap(before, before, 0.0, 0.0)
    effects = selection.model.build(validator.evidence.base)
    after = validator.score(effects)
    whole = before.gap - after.floor
    closed = (before.gap - after.gap) / whole if whole > 0 else 0.0
    start = recorded, recorded.evidence.base
    return after, _gap(before, after, closed, closed_error(start, start, (validator, effects)))


def _left(
    validator: Validator, selection: Selection, places: list[Place], after: Score, closed: float, named: bool
) -> tuple[list[Place], Unexplained | None]:
    """What the causes leave, and where; nothing where it does not stand out."""
    evidence, limit = validator.evidence, validator.config
    if not named:
        return places, unexplained_by(places, cuts_of(evidence, evidence.base, places), 1.0, selection.nearest)
    if not after.stands_out(limit):
        return [], None
    effects = selection.model.build(evidence.base)
    left = locate(evidence, validator.ruler, effects)
    cuts = cuts_of(evidence, effects, left)
    return left, unexplained_by(left, cuts, max(1 - closed, 0.0), selection.nearest)


def _gap(before: Score, after: Score, closed: float, half: float) -> Gap:
    return Gap(
        measure=MEASURE,
        unit=UNIT,
        before=before.gap,
        after=after.gap,
        floor=after.floor,
        closed_fraction=closed,
        ci95=(closed - half, closed + half),
    )
