"""The diagnosis of a depth sensor's sim-to-real gap, from a run folder alone.

measure   how far recording and simulation are apart, and how far two runs of one sensor would be
which     the effects that explain it, each fitted on some blocks of frames and judged on the others
how far   the gap again with the causes added
where     the axes along which it lies, before and after
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from depthsim.draws import Seed
from depthsim.errors import InputError
from depthsim.gap.config import DepthConfig, DepthSignificance
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.quantization import find_steps
from depthsim.gap.depth.fit.advice import advice_for
from depthsim.gap.depth.fit.candidates import hypotheses
from depthsim.gap.depth.fit.intervals import parameter_intervals
from depthsim.gap.depth.fit.select import Choice, choose
from depthsim.gap.depth.fit.validate import Judge, Score, closed_error
from depthsim.gap.depth.where.localize import Place, cuts_of, locate
from depthsim.gap.depth.where.residual import best_learned, describe
from depthsim.gap.diagnosis import Cause, Cut, Diagnosis, Gap, Unexplained, Verdict
from depthsim.materials import Materials, load_materials
from depthsim.runs.folder import Run, open_run
from depthsim.scene import Scene
from depthsim.scenefile.load import load_scene
from depthsim.sensor.effect import Effect
from depthsim.sensor.parameter import Setting
from depthsim.sensor.profile import Profile, load_profile

MEASURE = "Jensen-Shannon divergence of the errors' distributions, mean over all views"
UNIT = "bits per pixel"
_FAINTLY = (
    "the recording differs from the simulator by more than chance, but by less than a tenth of what two runs of one "
    "sensor differ by, and no effect explains it"
)
Say = Callable[[str], None]


@dataclass(frozen=True)
class Findings:
    """A diagnosis with all that it was made from, for the report.

    profile: the sensor before; fixed: with the causes added. places: the axes, before and after.
    """

    diagnosis: Diagnosis
    evidence: Evidence
    judge: Judge
    profile: Profile
    fixed: Profile
    before: Score
    after: Score
    choice: Choice | None
    places: list[Place]
    places_after: list[Place]


def diagnose(
    run: str | Path | Run,
    *,
    scene: str | Path | Scene | None = None,
    sensor: str | Path | Profile | Sequence[Effect] | None = None,
    out: str | Path | None = None,
    without: Sequence[str] = (),
    threads: int | None = None,
    materials: str | Path | Materials | None = None,
    config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
    say: Say = lambda _: None,
) -> Diagnosis:
    """Where a recording and its simulation differ, which effects cause it, and how far they close the gap.

    run: the recording, as a folder or open. scene: where it was taken; the run's own if not given. sensor: the profile
    that is compared with it, or effects alone; the run's sensor.yaml, or ``paper``. out: a folder for diagnosis.json,
    sensor.yaml and index.html. without: effects that are left out of the bank. config: the thresholds. say: told what
    is being done.

    Raises :class:`InputError` for a run, a scene or a profile that cannot be read.
    """
    found = investigate(
        run, scene=scene, sensor=sensor, without=without, threads=threads, materials=materials, config=config, say=say
    )
    if out is not None:
        from depthsim.gap.depth.report.write import Named, write_report

        say("drawing the report")
        given = sensor if sensor is None or isinstance(sensor, str | Path) else found.profile
        file = Path(materials) if isinstance(materials, str | Path) else None
        write_report(found, Path(out), Named(scene, given, file))
        return found.diagnosis.in_report(out)
    return found.diagnosis


def investigate(
    run: str | Path | Run,
    *,
    scene: str | Path | Scene | None = None,
    sensor: str | Path | Profile | Sequence[Effect] | None = None,
    without: Sequence[str] = (),
    threads: int | None = None,
    materials: str | Path | Materials | None = None,
    config: DepthConfig = DepthConfig(),  # noqa: B008 - frozen
    say: Say = lambda _: None,
) -> Findings:
    """As :func:`diagnose`, with everything that the diagnosis was made from."""
    opened, materials = open_run(run), load_materials(materials)
    profile = _profile(opened, sensor)
    say("casting the scene")
    evidence = Evidence(opened, _scene(opened, scene, materials), materials, profile.effects, threads, config=config)
    judge = Judge(evidence, evidence.test)
    say("measuring the gap")
    before = judge.score(evidence.base)
    notes = _notes(evidence)
    if not _stands_out(before, config.significance):
        return _nothing(evidence, judge, profile, before, notes)
    bank = hypotheses(evidence.base, setting_of(evidence), without, config.fit)
    choice = choose(evidence, judge, bank, before.gap, before.floor, say)
    if not choice.model.parts and before.above < config.significance.faint * before.floor:
        return _nothing(evidence, judge, profile, before, (*notes, _FAINTLY))
    effects = choice.model.build(evidence.base)
    say("locating the gap")
    places = locate(evidence, judge.ruler, evidence.base)
    where = cuts_of(evidence, evidence.base, places)
    after = judge.score(effects) if choice.model.parts else before
    whole = before.gap - after.floor
    fraction = _part(before.gap - after.gap, whole)
    half = closed_error(judge, evidence.base, effects) if choice.model.parts else 0.0
    places_after, unexplained = _rest(evidence, judge, choice, effects, before, after, places, where, fraction)
    fixed = _fixed(profile, effects)
    diagnosis = Diagnosis(
        verdict=_verdict(choice, after, fraction, unexplained),
        gap=_gap(before.gap, after.gap, after.floor, fraction, half),
        where=where,
        causes=_causes(evidence, judge, choice, whole),
        unexplained=unexplained,
        notes=notes,
    )
    return Findings(diagnosis, evidence, judge, profile, fixed, before, after, choice, places, places_after)


def _nothing(evidence: Evidence, judge: Judge, profile: Profile, before: Score, notes: tuple[str, ...]) -> Findings:
    """What is told where there is no gap."""
    gap = _gap(before.gap, before.gap, before.floor, 0.0, 0.0)
    diagnosis = Diagnosis(verdict="no_gap", gap=gap, where=(), causes=(), unexplained=None, notes=notes)
    return Findings(diagnosis, evidence, judge, profile, profile, before, before, None, [], [])


def remeasure(
    run: str | Path | Run,
    before: str | Path | Profile,
    after: str | Path | Profile,
    *,
    scene: str | Path | Scene | None = None,
    seed: int = 0,
) -> tuple[float, float, float]:
    """The gap of two profiles against a recording, and the floor of the second, on all blocks, by random numbers of
    their own: a check of a diagnosis' closed fraction."""
    opened, materials = open_run(run), load_materials()
    first, second = load_profile(before), load_profile(after)
    evidence = Evidence(opened, _scene(opened, scene, materials), materials, first.effects)
    judge = Judge(evidence, range(len(evidence.blocks)))
    real = judge.real.sum(axis=0)
    seeds = (Seed("remeasuring", 3 * seed + k) for k in range(3))
    profiles = (first, second, second)
    runs = [judge.simulate(p.effects, s).sum(axis=0) for p, s in zip(profiles, seeds, strict=True)]
    gaps = [judge.ruler.gap(real, one) for one in runs]
    return gaps[0], gaps[1], judge.ruler.gap(runs[1], runs[2])


def setting_of(evidence: Evidence) -> Setting:
    """What of the recording decides where fits begin."""
    tags = tuple(t for i, t in enumerate(evidence.scene.tags) if evidence.cuts.shown_tags[i] >= 0)
    quantiles = np.quantile(evidence.depths, Setting.SHARES).astype(float)
    stamps = [still.stamp for still in evidence.stills.values()]
    return Setting(tags, quantiles, max(stamps) - min(stamps), evidence.materials, find_steps(evidence))


def _profile(run: Run, sensor: str | Path | Profile | Sequence[Effect] | None) -> Profile:
    if sensor is None:
        own = run.path / "sensor.yaml"
        profile = load_profile(own if own.is_file() else "paper")
    else:
        profile = load_profile(sensor)
    if profile.stereo is not None:
        raise InputError(
            profile.name, "camera.sensor", "is active stereo, which has no effects to fit", "give a profile of effects"
        )
    return profile


def _scene(run: Run, scene: str | Path | Scene | None, materials: Materials) -> Scene:
    found = scene if scene is not None else run.scene
    if found is None:
        raise InputError(run.path, "", "holds no scene", "put scene.obj or scene.yaml there, or give --scene")
    return load_scene(found, materials=materials)


def _notes(evidence: Evidence) -> tuple[str, ...]:
    """What a reader must know besides."""
    looked, whole = len(evidence.stills), len(evidence.run)
    notes = [f"{looked} of {whole} frames were looked at, in {len(evidence.blocks)} blocks"] if looked < whole else []
    poses = evidence.run.poses
    if len(poses) > 1 and np.abs(poses - poses[0]).max() < 1e-6:
        notes.append("the camera stands still: errors of pose, time and motion cannot be seen")
    return (*notes, *evidence.run.remarks)


def _stands_out(score: Score, limit: DepthSignificance) -> bool:
    """Whether there is more than chance between recording and simulation."""
    along = bool(score.excess_by_view.max() > limit.excess_along_axis)
    return score.above > 0 and (score.excess > limit.excess or along)


def _gap(before: float, after: float, floor: float, fraction: float, half: float) -> Gap:
    ci95 = (fraction - half, fraction + half)
    return Gap(measure=MEASURE, unit=UNIT, before=before, after=after, floor=floor, closed_fraction=fraction, ci95=ci95)


def _part(closed: float, whole: float) -> float:
    """What of the gap is closed; nothing of none."""
    return closed / whole if whole > 0 else 0.0


def _causes(evidence: Evidence, judge: Judge, choice: Choice, whole: float) -> tuple[Cause, ...]:
    """The causes, the one that closes most first. whole: the gap over the floor of the sensor with all of them.

    Causes overlap: the mean over all orders adds up to what they close together, taking one away does not.
    """
    model = choice.model
    intervals = parameter_intervals(evidence, judge.ruler, evidence.base, model)
    causes = []
    for number, part in enumerate(model.parts):
        without = model.less(number).build(evidence.base)
        full = model.build(evidence.base)
        fraction, half = _part(choice.shares[number], whole), closed_error(judge, without, full)
        ties = choice.ties.get(part.effect, ())
        causes.append(
            Cause(
                effect=part.effect,
                parameters=_plain(model.parameters(number)),
                ci95=intervals[number],
                closed_fraction=fraction,
                ci95_closed=(fraction - half, fraction + half),
                indistinguishable_from=ties,
                advice=advice_for(part.effect, ties),
            )
        )
    return tuple(sorted(causes, key=lambda cause: -cause.closed_fraction))


def _plain(value: Any) -> Any:
    """Numbers with six figures, which is more than any fit gives."""
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items()}
    return float(f"{value:.6g}") if isinstance(value, float) else value


def _rest(
    evidence: Evidence,
    judge: Judge,
    choice: Choice,
    effects: Sequence[Effect],
    before: Score,
    after: Score,
    places: list[Place],
    where: tuple[Cut, ...],
    fraction: float,
) -> tuple[list[Place], Unexplained | None]:
    """What is left when the causes are added."""
    if not choice.model.parts:
        text = describe(places, where)
        learnable = best_learned(places)
        return places, Unexplained(fraction=1.0, where=where, description=text, learnable=learnable)
    limit = evidence.config.significance
    if not _stands_out(after, limit) or fraction >= limit.explained:
        return [], None
    left = locate(evidence, judge.ruler, effects)
    cuts = cuts_of(evidence, effects, left)
    text = describe(left, cuts)
    learnable = best_learned(left)
    return left, Unexplained(fraction=max(1 - fraction, 0.0), where=cuts, description=text, learnable=learnable)


def _verdict(choice: Choice, after: Score, fraction: float, rest: Unexplained | None) -> Verdict:
    if not choice.model.parts:
        return "unexplained"
    return "explained" if rest is None else "partly_explained"


def _fixed(profile: Profile, effects: Sequence[Effect]) -> Profile:
    """The profile with the causes added, its parameters as they are told."""
    rounded = tuple(type(e)(**_plain(e.model_dump())) for e in effects)
    return profile.model_copy(update={"name": f"{profile.name}_fitted", "effects": rounded, "camera": None})
