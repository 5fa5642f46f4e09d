"""What of a recording is compared with the simulator: its frames as they are, registered with the scene, or told from
the depth that biases which were found give."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from depthsim.gap.depth.data.divergence import MEASURE, UNIT
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.fit.fitting import Say
from depthsim.gap.depth.fit.poses import Poses, is_for_what_lags, register_frames
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Score, Validator, closed_error
from depthsim.gap.diagnosis import Gap
from depthsim.sensor.effect import Effect


@dataclass(frozen=True)
class Compared:
    """Frames that the gap is measured on, and the same as causes are looked for on them.

    recorded: those that are reported on, as they were recorded; before: their gap. reported: the same, as causes are
    looked for on them; selecting: those that causes are selected on. drawn: what a report draws, where errors are told
    from the scene's depth. errors: what the poses are off by, where that was asked; poses: what registration found,
    where frames are registered.
    """

    recorded: Validator
    reported: Validator
    selecting: Validator
    drawn: Validator
    before: Score
    errors: PoseErrors | None = None
    poses: Poses | None = None

    @classmethod
    def of(cls, given: Evidence) -> "Compared":
        """The frames as they were recorded."""
        reported, selecting = in_parts(given)
        return cls(reported, reported, selecting, reported, reported.score(given.base))

    @property
    def evidence(self) -> Evidence:
        """What causes are looked for in."""
        return self.reported.evidence

    @property
    def differ(self) -> bool:
        """Whether they differ from the simulator by more than chance, those that are reported on or the others."""
        limit = self.evidence.config.significance
        return self.before.stands_out(limit) or self.selecting.score(self.evidence.base).stands_out(limit)

    def registered(self, without: Sequence[str], say: Say) -> "Compared":
        """Registered with the scene, where the poses are off and that is for no effect of the sensor.

        without: effects that are not in the bank.
        """
        say("registering the frames")
        given = self.evidence
        errors, poses = register_frames(given)
        known = replace(self, errors=errors)
        if poses is None:
            return known
        reported, selecting = in_parts(poses.evidence)
        if not poses.bring_nearer(self.recorded, reported):
            return known
        if is_for_what_lags(given, errors, self.selecting.blocks, without, say):
            return known
        given.forget(given.test)
        return replace(known, reported=reported, selecting=selecting, drawn=reported, poses=poses)

    def as_given(self, evidence: Evidence) -> "Compared":
        """Not registered after all. evidence: the frames as they were recorded."""
        self.evidence.forget(())  # most of what is kept in memory
        reported, selecting = in_parts(evidence)
        return replace(self, recorded=reported, reported=reported, selecting=selecting, drawn=reported, poses=None)

    def of_simulator(self, base: Sequence[Effect]) -> "Compared":
        """Compared with another simulator, with errors measured as they are."""
        every = (self.recorded, self.reported, self.selecting, self.drawn)  # of which some are the same
        own = {one: Validator(one.evidence.as_of_simulator(base), one.blocks) for one in dict.fromkeys(every)}
        recorded, reported, selecting, drawn = (own[one] for one in every)
        return replace(
            self, recorded=recorded, reported=reported, selecting=selecting, drawn=drawn, before=recorded.score(base)
        )

    def centred(self, parts: tuple[Validator, Validator], found: Sequence[Effect]) -> "Compared":
        """Told from the depth that a sensor gives. parts: as :func:`in_parts` has them; found: the sensor."""
        reported, selecting = parts
        recorded = self.recorded
        # Before and after are measured from the same depth, also where the frames were registered between.
        if recorded is self.reported:
            recorded = reported
        elif moved := recorded.evidence.centred(found, however_small=True):
            recorded = Validator(moved, recorded.blocks)
        before = recorded.score(recorded.evidence.base)
        return replace(self, recorded=recorded, reported=reported, selecting=selecting, before=before)

    def from_recorded(self) -> "Compared":
        """With the poses' errors as a part of the gap."""
        return replace(self, drawn=self.recorded)

    def from_reported(self) -> "Compared":
        """Without what the poses' errors make of the gap."""
        if self.recorded is self.reported:
            return self
        return replace(self, recorded=self.reported, before=self.reported.score(self.evidence.base))


def in_parts(evidence: Evidence) -> tuple[Validator, Validator]:
    """The frames that are reported on, and those that causes are selected on."""
    reported = Validator(evidence, evidence.test)
    return reported, Validator(evidence, evidence.held_out) if evidence.in_three else reported


def how_far(compared: Compared, selection: Selection) -> tuple[Score, Gap]:
    """The gap with the causes added: measured again, as before, on frames that nothing was fitted on."""
    recorded, reported, before = compared.recorded, compared.reported, compared.before
    if not selection.model.parts and recorded is reported:
        return before, gap_of(before, before)
    effects = selection.model.build(reported.evidence.base)
    after = reported.score(effects)
    whole = before.gap - after.floor
    closed = (before.gap - after.gap) / whole if whole > 0 else 0.0
    start = recorded, recorded.evidence.base
    return after, gap_of(before, after, closed, closed_error(start, start, (reported, effects)))


def gap_of(before: Score, after: Score, closed: float = 0.0, half: float = 0.0) -> Gap:
    """A gap in words of a report. closed: the fraction that is closed, half: half the width of its interval."""
    return Gap(
        measure=MEASURE,
        unit=UNIT,
        before=before.gap,
        after=after.gap,
        floor=after.floor,
        closed_fraction=closed,
        ci95=(closed - half, closed + half),
    )
