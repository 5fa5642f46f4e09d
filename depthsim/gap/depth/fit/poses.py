"""The recording's poses as a cause of the gap, measured by registration before anything is fitted.

A rigid motion of a whole frame looks like many an effect of the sensor. Once the frames are registered it is gone, and
everything else is diagnosed without it; the gap that it makes is what registering takes off.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.data.registration import Registration, register
from depthsim.gap.depth.fit.agreement import leaves_biases
from depthsim.gap.depth.fit.candidates import candidates, setting_of
from depthsim.gap.depth.fit.fitting import Fitting, Say
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Validator, closed_error
from depthsim.sensor.effect import Effect, effect_class
from depthsim.sensor.effects.extrinsics import ExtrinsicRotation, ExtrinsicTranslation
from depthsim.sensor.effects.pose_noise import PoseNoise

_LATE = (
    "what the poses are off by lies along the camera's own motion, so it is their times that differ: stamps that are "
    "late or early, or frames that were repeated or lost"
)
_WANDERS = (
    "from frame to frame the disparities are off by an offset and a scale that change, which explain more than errors "
    "of the poses would"
)
_LASTS = (
    "the frames are off the scene by what a motion as long as the recording would make, and another bias of the camera "
    "as well: a longer recording tells them apart"
)
_WORSE, _NEARER = 1.1, 0.5
"""Times the gap as it is: above the one, registering the frames makes it larger by more than chance; below the other,
it makes it much smaller, where what is alike in all frames is taken off, too."""
_MOUNTS = (ExtrinsicRotation.id, ExtrinsicTranslation.id)
"""Constant errors of the poses, beside which something may lag behind."""
_NEAR = 0.8
"""Of what must be closed, so much of it on a few frames, after some rounds, is worth a fit on all of them."""
_SURE = 3.0
"""Standard errors that the poses' errors must be off from those that the simulator has."""


@dataclass(frozen=True)
class Poses:
    """What registration found. held: the errors that the simulator's poses have; evidence: the registered frames,
    whose simulator has right poses.
    """

    registration: Registration
    held: PoseNoise | None
    evidence: Evidence

    @property
    def errors(self) -> PoseErrors:
        """What the recording's poses are off by."""
        return self.registration.errors

    @property
    def are_as_held(self) -> bool:
        """Whether the simulator's poses are off by as much as the recording's."""
        if self.held is None:
            return False
        intervals = self.errors.intervals(_SURE)
        return all(low <= getattr(self.held, name) <= high for name, (low, high) in intervals.items())

    def effects(self, is_cause: bool) -> tuple[PoseNoise, ...]:
        """What a simulator with such poses has."""
        if is_cause:
            return (self.errors.effect(),)
        return () if self.held is None else (self.held,)

    def bring_nearer(self, recorded: Validator, registered: Validator) -> bool:
        """Whether the frames are nearer to the scene once they are registered, or no farther.

        What a filter in time leaves behind moves like a pose that is off, and is none. Beside a mount that is turned,
        which is left in, no frame may be nearer than before: then that is taken off as well, for this question alone.
        """
        base, before = self.evidence.base, recorded.quick(recorded.evidence.base)
        if registered.quick(base) <= _WORSE * before:
            return True
        whole = _registered(recorded.evidence, self.registration, constant=True)
        return Validator(whole, registered.blocks).quick(base) < _NEARER * before

    def note(self, is_cause: bool) -> str:
        """What a reader must know of it."""
        if is_cause or self.held is not None:
            return f"{self.errors.text}: all else was diagnosed on frames registered with the scene"
        return "the frames were registered with the scene, which makes next to no difference to the gap"


def no_poses(errors: PoseErrors | None) -> str:
    """Why frames that differ from the scene were not registered with it, for a reader; "" where nothing differs."""
    if errors is None or errors.is_unknown:
        return ""
    if errors.are_repeated:
        return f"{errors.repeated:.0%} of the pictures are the one before, pixel for pixel, while the poses go on"
    if errors.are_of_time:
        return _LATE
    return _WANDERS if errors.are_of_disparity else _LASTS if errors.are_lasting else ""


def register_frames(given: Evidence) -> tuple[PoseErrors, Poses | None]:
    """What the poses are off by, and the frames of ``given`` where they fit the scene.

    None in place of these where the poses are right from frame to frame, or nobody knows, or what differs from frame to
    frame are times or the sensor's scale, or lasts.
    """
    held = next((effect for effect in given.base if isinstance(effect, PoseNoise)), None)
    frames = sorted(int(i) for block in given.blocks for i in block)
    found = register(given.run, given.caster, frames, given.threads)
    errors = found.errors
    if errors.are_of_others or (errors.is_none and (held is None or held.is_neutral)):
        return errors, None
    return errors, Poses(found, held, _registered(given, found))


def is_for_what_lags(
    given: Evidence, errors: PoseErrors, blocks: Sequence[int], without: Sequence[str], say: Say
) -> bool:
    """Whether an effect that looks back closes nearly all of the gap of frames as they are, alone or beside a mount
    that is off: before a camera that moves, what lags behind is like poses that are off.

    errors: what registration found; blocks: those that it is asked on.
    """
    setting = setting_of(given, errors=errors)
    every = candidates(given.base, setting, without, given.config.fit)
    bank = [one for one in every if effect_class(one.effect)().looks_back]
    if not bank:
        return False
    fitting = Fitting(given, Validator(given, blocks), bank, given.base, say)
    limit, first = given.config.agreement.nearly_all, given.config.select.first

    def closes(model: Model, rounds: int) -> bool:
        trial = fitting.validated(fitting.fit(model, rounds))
        return fitting.before - trial.gap >= limit * fitting.whole

    # What looks back takes many frames for each of one, and comes nowhere near where poses are really off.
    begun = [fitting.begin_on_few(one) for one in bank]
    near = [model for model, share in begun if share >= _NEAR * limit]
    if any(closes(model, 2) for model in near):
        return True
    best, share = max(begun, key=lambda one: one[1])
    if share < first:
        return False
    for one in every:
        if one.effect in _MOUNTS:
            both, share = fitting.begin_on_few(one, best)
            if share >= _NEAR * limit and closes(both, 4):
                return True
    return False


def explained_as_given(given: Evidence, registered: Validator, selection: Selection, say: Say) -> Evidence | None:
    """The frames as they are, if the causes that were found on registered ones do as well there: then no errors of the
    poses are needed. None if they do not, or are none that a rigid motion of a frame may take up some of.

    registered: the frames that the causes were selected on.
    """
    model, limit = selection.model, given.config.select
    if all(one.kinds[0] != "bias" for one in model.effects):
        return None
    evidence = Evidence(given.run, given.scene, given.materials, given.base, given.threads, given, given.config)
    fitting = Fitting(evidence, Validator(evidence, registered.blocks), (), evidence.base, say)
    say("fitting the causes to the frames as they are")
    left = registered.quick(model.build(registered.evidence.base), given.config.fit.runs)
    gap = fitting.validated(fitting.fit(model, 4)).gap
    return evidence if gap - left < limit.tied * fitting.whole else None


def _registered(given: Evidence, found: Registration, constant: bool = False) -> Evidence:
    """The frames of ``given`` where they fit the scene. constant: see :meth:`Registration.applied`."""
    run, base = found.applied(given.run, constant), without_errors(given.base)
    return Evidence(run, given.scene, given.materials, base, given.threads, given, given.config)


def without_errors(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """A sensor at poses that are right."""
    return tuple(effect for effect in effects if not isinstance(effect, PoseNoise))


def matter(recorded: Validator, registered: Validator, selection: Selection) -> bool:
    """Whether the poses' errors make more of a gap, beside the other causes, than a faint one, and surely or much."""
    model, runs, start = selection.model, registered.config.runs, (recorded, recorded.evidence.base)
    with_errors = model.build(recorded.evidence.base)
    right = model.build(registered.evidence.base)
    score = registered.score(right)
    gap = recorded.quick(with_errors, runs)
    closed = gap - score.gap
    if closed <= registered.config.faint * score.floor or leaves_biases((recorded, with_errors), (registered, right)):
        return False
    share = closed / max(recorded.score(start[1]).gap - score.floor, 1e-12)
    limit = registered.evidence.config.select
    if not model.parts:  # the only cause must close as much as any other one
        return share >= limit.first
    much = share >= limit.further or closed >= limit.further_of_left * (gap - score.floor)
    return much or share > closed_error(start, (recorded, with_errors), (registered, right))
