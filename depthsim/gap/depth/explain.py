"""Which effects explain the gap: on the frames as they are or registered, then behind the biases that were found."""

from collections.abc import Sequence
from functools import partial

from depthsim.gap.depth.compared import Compared, how_far, in_parts
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.fit import withdraw
from depthsim.gap.depth.fit.alignment import select_aligned
from depthsim.gap.depth.fit.candidate import Candidate
from depthsim.gap.depth.fit.candidates import candidates, setting_of
from depthsim.gap.depth.fit.finer import with_fine_pattern
from depthsim.gap.depth.fit.fitting import Say
from depthsim.gap.depth.fit.pattern import learn_pattern
from depthsim.gap.depth.fit.poses import explained_as_given, matter
from depthsim.gap.depth.fit.select import Selection, select, select_more
from depthsim.gap.depth.fit.tiles import select_tiled
from depthsim.gap.depth.fit.validate import Validator
from depthsim.sensor.effects.align import AlignToColor
from depthsim.sensor.effects.decimation import Decimation
from depthsim.sensor.effects.fixed_pattern import FixedPattern
from depthsim.sensor.effects.pose_noise import PoseNoise


def explain(compared: Compared, without: Sequence[str], say: Say) -> tuple[Compared, Selection, bool]:
    """The effects that explain the gap, the frames that they do it on, and whether the poses' errors are a cause.

    without: effects that are not in the bank.
    """
    compared, selection = _explained(compared, without, say)
    selection, poses_are_cause = _kept(compared, selection, say)
    if not poses_are_cause:
        selection = withdraw.little(compared.selecting, selection)
    compared.evidence.forget_totals()
    return (compared.from_recorded() if poses_are_cause else compared.from_reported()), selection, poses_are_cause


def _explained(compared: Compared, without: Sequence[str], say: Say) -> tuple[Compared, Selection]:
    """The effects that explain the gap, and the frames that they do it on."""
    bank = _bank(compared.evidence, without, compared.errors)
    selection = _which(compared.selecting, bank, without, compared.errors, say)
    if compared.poses is not None:
        given = compared.recorded.evidence
        if (as_it_is := explained_as_given(given, compared.selecting, selection, say)) is not None:
            compared = compared.as_given(as_it_is)
            bank = _bank(as_it_is, without, compared.errors)
            selection = _which(compared.selecting, bank, without, compared.errors, say)
    return _behind_biases(compared, bank, selection, say) if selection.model.parts else (compared, selection)


def _behind_biases(
    compared: Compared, bank: Sequence[Candidate], selection: Selection, say: Say
) -> tuple[Compared, Selection]:
    """What else is there where errors are told from the depth that the biases that were found give."""
    evidence = compared.evidence
    if any(part.effect == evidence.supposed for part in selection.model.parts):
        return compared, selection  # what noise there is, is not known well enough to tell what is small behind biases
    found = selection.model.build(evidence.base)
    centred = evidence.centred(found)
    if centred is not None and (finer := with_fine_pattern(compared.selecting, selection, say)) is not selection:
        selection = finer  # what a smooth pattern leaves of a large one would hide as much
        found = selection.model.build(evidence.base)
        centred = evidence.centred(found, however_small=True)
    if centred is None:
        return compared, selection
    say("looking behind the biases")
    own = in_parts(centred)
    more = select_more(own[1], bank, selection, say)
    return (compared.centred(own, found), more) if more else (compared, selection)


def _kept(compared: Compared, selection: Selection, say: Say) -> tuple[Selection, bool]:
    """The causes that stay once all of them are known, and whether the poses' errors are one."""
    reported, selecting, poses = compared.reported, compared.selecting, compared.poses
    if reported is not selecting:
        selection = withdraw.unsupported(reported, selecting, selection)
    selection = withdraw.cancelling(selecting, selection)
    selection = withdraw.left_by_biases(selecting, selection)
    selection = withdraw.filled(selecting, selection)
    selection = with_fine_pattern(selecting, selection, say)
    selection = withdraw.as_nothing(reported, selecting, selection)
    if poses is None:
        return selection, False
    is_cause = not poses.are_as_held and matter(compared.recorded, reported, selection)
    above = compared.before.above if is_cause else 0.0
    selection = withdraw.left_by_poses(poses.errors, selecting, selection, above)
    if not is_cause:
        return selection, False
    selection = withdraw.adding_nothing(reported, selecting, selection, compared.recorded)
    # Where the frames differ so much that all together may close nothing, what closes least is not for the poses.
    return selection, how_far(compared, selection)[1].ci95[0] > 0


def _which(
    validator: Validator, bank: Sequence[Candidate], without: Sequence[str], errors: PoseErrors | None, say: Say
) -> Selection:
    """The effects that explain the gap, of the bank. without: those that are not in it; errors: of the poses."""

    def beside(known: str, resampled: Evidence) -> Selection:
        less = (*without, known)
        return _which(in_parts(resampled)[1], _bank(resampled, less, errors), less, errors, say)

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
