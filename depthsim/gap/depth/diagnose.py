"""The diagnosis of a depth sensor's sim-to-real gap, from a run folder alone.

is there a gap   how far recording and simulation are apart, and how far two runs of one sensor would be
which            the effects that explain it, each fitted on some blocks of frames and validated on the others
how far          the gap again with the causes added
where            the axes along which it lies, before and after; what lies there after is unexplained
what it costs    the figures that a robot's software sees, of the recording and of the simulator before and after
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from threadpoolctl import threadpool_limits

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.compared import Compared, gap_of, how_far
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.load import load_evidence, notes_of
from depthsim.gap.depth.explain import explain
from depthsim.gap.depth.findings import Findings
from depthsim.gap.depth.fit import withdraw
from depthsim.gap.depth.fit.basic_noise import as_cause, basic_noise
from depthsim.gap.depth.fit.causes import causes_of, fixed_profile
from depthsim.gap.depth.fit.marks import is_carried, seams_beside, waves_beside
from depthsim.gap.depth.fit.poses import no_poses
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.unseen import in_words, unseen
from depthsim.gap.depth.fit.validate import Score, Validator
from depthsim.gap.depth.tasks.measure import tasks_of
from depthsim.gap.depth.tasks.odometry import Odometry
from depthsim.gap.depth.where.localize import Place, cuts_of, locate
from depthsim.gap.depth.where.residual import unexplained_by
from depthsim.gap.diagnosis import Cut, Diagnosis, Unexplained
from depthsim.gap.report.folder import check_report_folder
from depthsim.gap.selection import verdict_of
from depthsim.materials import Materials
from depthsim.runs.folder import Run
from depthsim.scene import Scene
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.sensor.effects.align import AlignToColor
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
_UNFINISHED = (
    "the search ended at its budget of simulated pixels (fit.most_work) with something left: there may be more causes"
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
    # More threads of linear algebra would spin beside our own, and sum in other orders.
    with threadpool_limits(limits=1, user_api="blas"):
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
    without = (*without, *_never(given))

    say("measuring the gap")
    compared = Compared.of(given)
    if not compared.differ:
        return _no_gap(compared, profile, *_blind(given, without))
    say("locating the gap")
    places = locate(given, compared.reported.ruler, given.base)
    where = cuts_of(given, given.base, places)
    if given.has_ray_lengths:  # whatever came near to that would be no cause
        without = effect_ids()

    found = _beside_a_law(given, without, say)
    found = found or _explained(_registered(compared, without, say), where, without, say)
    compared, selection, poses_are_cause = found
    before, evidence = compared.before, compared.evidence

    named = bool(selection.model.parts) or poses_are_cause
    remarks = _remarks(compared, selection, poses_are_cause, without)
    if not named and not before.stands_out(config.significance) and compared.poses is not None:
        return _no_gap(compared, profile, *remarks)
    if not named and before.above < config.significance.faint * before.floor:
        return _no_gap(compared, profile, *remarks, _FAINTLY)
    after, gap = how_far(compared, selection)

    say("locating what is left")
    places_after, unexplained = _left(compared.reported, selection, places, after, gap.closed_fraction, named)

    as_given, errors = (compared.recorded, compared.errors) if poses_are_cause else (None, None)
    diagnosis = Diagnosis(
        verdict=verdict_of(named, unexplained),
        gap=gap,
        where=where,
        causes=causes_of(compared.reported, selection, before.gap - after.floor, as_given, errors),
        unexplained=unexplained,
        notes=(*notes_of(evidence), *remarks),
    )
    poses = compared.poses
    fixed = (*selection.model.build(evidence.base), *(() if poses is None else poses.effects(poses_are_cause)))
    return Findings(
        diagnosis, compared.drawn.evidence, compared.drawn, profile, fixed_profile(profile, fixed), before, after,
        selection, places, places_after,
    )  # fmt: skip


def _beside_a_law(given: Evidence, without: Sequence[str], say: Say) -> tuple[Compared, Selection, bool] | None:
    """As :func:`_explained`, beside a law of the noise, for a simulator that has none; None where it has some, or the
    recording's noise is no such law, nor that of other causes: then nothing is known of what was found beside it."""
    law = basic_noise(given, without)
    if law is None:
        return None
    say("taking a law of the noise, as the simulator has none")
    noisy = given.beside(law.build(given.base)[-1])
    compared = Compared.of(noisy)
    where = cuts_of(noisy, noisy.base, locate(noisy, compared.reported.ruler, noisy.base))
    found, selection, poses_are_cause = _explained(_registered(compared, without, say), where, without, say)
    compared = found.of_simulator(given.base)
    kept = as_cause(compared, selection, law, without, say)
    if kept is None:
        say("looking for causes once more, without a law of the noise")
        return None
    return compared, kept, poses_are_cause


def _registered(compared: Compared, without: Sequence[str], say: Say) -> Compared:
    """Registered with the scene, if errors of the poses may be a cause."""
    return compared if PoseNoise.id in without else compared.registered(without, say)


def _explained(
    compared: Compared, where: Sequence[Cut], without: Sequence[str], say: Say
) -> tuple[Compared, Selection, bool]:
    """As :func:`explain`, without what does not act where the gap lies.

    Where that is all of it, and another effect is known by the axis on which the gap lies first, once more without it.
    """
    found = explain(compared, without, say)
    kept = _acting(found, where)
    refused = [part.effect for part in found[1].model.parts]
    were_registered = compared.poses is not None and found[0].poses is None  # their geometry is gone
    if not refused or kept[1].model.parts or found[2] or were_registered:
        return kept
    if not withdraw.is_for_another(found[1], where):
        return kept
    say(f"looking for causes once more, without {' and '.join(refused)}")
    again = _acting(explain(compared, (*without, *refused), say), where)
    return again if again[1].model.parts else kept


def _acting(found: tuple[Compared, Selection, bool], where: Sequence[Cut]) -> tuple[Compared, Selection, bool]:
    """Without what does not act where the gap lies, or on some frames only."""
    compared, selection, poses_are_cause = found
    if not selection.model.parts or poses_are_cause or compared.evidence.stands_still:
        return found
    gap = how_far(compared, selection)[1]
    kept = withdraw.acting_elsewhere(compared.reported, selection, compared.before, gap.closed_fraction, where)
    if kept.model.parts and gap.ci95[0] <= 0:
        kept = withdraw.unsure(compared.reported, kept, compared.before)
    return compared, kept, poses_are_cause


def _never(given: Evidence) -> Iterator[str]:
    """Effects that no cause can be in this recording."""
    if given.camera.aligned and any(isinstance(effect, AlignToColor) for effect in given.base):
        yield AlignToColor.id
    if given.lags.frames > 1:  # what goes together with the frame before would show itself there
        yield from sorted(name for name in effect_ids() if effect_class(name).axes[:1] == ("frame_neighbours",))
    if given.rows < given.camera.height:  # bands of rows are not resampled, and many frames before each cost as much
        yield from sorted(
            name for name in effect_ids() if effect_class(name).resizes() or effect_class(name)().looks_back
        )


def _remarks(
    compared: Compared, selection: Selection, poses_are_cause: bool, without: Sequence[str]
) -> tuple[str, ...]:
    """What a reader must know beside the causes."""
    reported, poses = compared.reported, compared.poses
    effects = selection.model.build(compared.evidence.base)
    said = poses.note(poses_are_cause) if poses else "" if selection.model.parts else no_poses(compared.errors)
    length = waves_beside(reported, effects)
    waves = f"the recording's errors come in waves of {length:.3g} px, and no simulated ones" if length else ""
    side = seams_beside(reported, effects)
    seams = f"the recording's errors break every {side} columns, as those of a lossy codec do" if side else ""
    carried = _CARRIED if is_carried(reported, effects) else ""
    unfinished = _UNFINISHED if selection.is_unfinished else ""
    named = (cause.effect for cause in selection.model.parts)
    return *filter(None, (said, waves, seams, carried, unfinished)), *_blind(compared.evidence, (*without, *named))


def _blind(evidence: Evidence, without: Sequence[str]) -> tuple[str, ...]:
    """A note on the effects that this recording cannot show."""
    names = unseen(evidence, without)
    return (in_words(names),) if names else ()


def _no_gap(compared: Compared, profile: Profile, *notes: str) -> Findings:
    """What is found where there is no gap."""
    seen, before = compared.recorded, compared.before
    gap = gap_of(before, before)
    notes = (*notes_of(seen.evidence), *notes)
    diagnosis = Diagnosis(verdict="no_gap", gap=gap, where=(), causes=(), unexplained=None, notes=notes)
    return Findings(diagnosis, seen.evidence, seen, profile, profile, before, before, None, [], [])


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
