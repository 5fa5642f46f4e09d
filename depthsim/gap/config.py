"""All thresholds of the diagnoses, documented and frozen, so that a benchmark can vary them: ``diagnose(config=...)``.

What is measured (histogram bins, the cells of the axes, the measure itself) is no threshold, and stands with its code.
docs/thresholds.md lists them; docs/thresholds.py writes it from here.
"""

from collections.abc import Iterable
from typing import Self

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from depthsim.errors import InputError


class Section(BaseModel):
    """Some thresholds that go together."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Config(Section):
    """All thresholds of a diagnosis, by section."""

    @classmethod
    def varied(cls, settings: Iterable[str]) -> Self:
        """With some values in place of the defaults, each as ``section.name=value``.

        Raises :class:`InputError` for one that is not written so, that there is not, or whose value makes no sense.
        """
        changes: dict[str, dict[str, str]] = {}
        for setting in settings:
            name, equals, value = setting.partition("=")
            section, dot, field = name.partition(".")
            if not (equals and dot and section and field and value):
                raise InputError("config", setting, "is no SECTION.NAME=VALUE", "write such as select.most_causes=2")
            changes.setdefault(section, {})[field] = value
        try:
            return cls.model_validate(changes)
        except ValidationError as error:
            first = error.errors()[0]
            place = ".".join(map(str, first["loc"]))
            fix = f"take the names from {cls.__name__} in depthsim/gap/config.py"
            raise InputError("config", place, str(first["msg"]), fix) from None


def _value(default: float, about: str) -> float:
    field: float = Field(default, ge=0, allow_inf_nan=False, description=about)
    return field


def _count(default: int, about: str) -> int:
    field: int = Field(default, ge=1, description=about)
    return field


class DepthData(Section):
    """What of a recording is looked at, and what is seen in it before anything is fitted."""

    pixels: int = _count(9_000_000, "simulated in all, about: of larger frames bands of rows, others in every block")
    least_rows: int = _count(96, "in such bands, for which of very wide pictures fewer frames are looked at")
    least_frames: int = _count(20, "looked at of a recording that has as many, however wide they are")
    most_frames: int = _count(40, "looked at, however small they are")
    block: int = _count(2, "frames in a row at most that go together, into fitting, selecting or reporting")
    least_blocks: int = _count(9, "of which a third each are for fitting, selecting and reporting; of fewer, half each")
    pixels_of_frame: int = _count(50_000, "that are counted, about: of a larger frame, not every row")
    material_share: float = _value(0.002, "of the pixels, above which a material has cells of its own")
    most_materials: int = _count(10, "materials with cells of their own at most")
    far_less_noise: float = _value(
        0.35, "of the simulator's spread: errors of a recording that has less are measured in a spread of its own"
    )
    far_more_noise: float = _value(5.0, "the same, of one that has more, as against a simulator without noise")
    hidden: float = _value(
        0.25, "of the pixels, off by more than their spread: behind such biases other causes are looked for once more"
    )
    coarsest_step: float = _value(2.0, "[px] of disparity: coarser steps are indistinguishable from the scene's shape")
    step_seen: float = _value(0.15, "of the spectrum's line, 1 where all disparities lie on steps: below it none are")
    step_over_scene: float = _value(3.0, "times the scene's own spectrum that the line must be, too")
    doubling_seen: float = _value(
        100.0, "times the median of the spectrum of equal neighbours: with a lower peak, no rows were doubled"
    )
    doubled_equal: float = _value(
        0.5, "of the pixels of doubled rows, as many of which must equal the ones above, at least, or none were doubled"
    )
    overtone: float = _value(0.6, "of the strongest line: the lowest frequency with so much is that of the steps")
    farther_together: float = _value(
        0.1,
        "of signs of errors, by which they must go together more with those some way off, in pixels or frames, than "
        "with the next ones and at the usual lag, and twice as much: then those some way off are looked at",
    )


class DepthFit(Section):
    """How candidates are fitted."""

    first_look_pixels: int = _count(400_000, "that are enough for a first look at the whole bank")
    leaders: int = _count(6, "candidates that are fitted in full after the first look")
    leaders_of_kind: int = _count(4, "of these that make the same kind of error, as long as others do something")
    looked_at: int = _count(
        14, "of the bank that are fitted in a first look, by how they begin, beside those that begin with nothing"
    )
    looked_at_again: int = _count(8, "the same for a further cause")
    promising: float = _value(
        0.05,
        "of the best gain: what takes long to simulate is looked at if slopes promise so much, and fitted in full if a "
        "first look takes off as much",
    )
    rounds_from_beyond: int = _count(3, "of a first look at what begins farther off than nothing; of others one")
    places: int = _count(3, "where fits of a leader begin that has many parameters")
    rounds_elsewhere: int = _count(4, "from each of these places, on a few frames")
    louder: float = _value(5.0, "changes that matter, by which a noise is larger where a fit of its correlation begins")
    far_behind: float = _value(2.0, "times the least loss: a candidate above it after two rounds is fitted no further")
    behind: float = _value(1.25, "the same, above which no other minima are looked for beside the one it is in")
    same_minimum: float = _value(
        0.01, "of the loss: a fit from elsewhere that ends so near has come to the same minimum"
    )
    trial: float = _value(0.25, "of a change that matters, by which a parameter is moved to find its slope")
    longest_step: float = _value(4.0, "changes that matter, by which a parameter moves at once")
    least_gain: float = _value(0.004, "of the loss: a round that takes off no more is the last")
    refined_rounds: int = _count(24, "at most in which the selected causes are refined at the end")
    refined_gain: float = _value(1e-4, "of the loss: the same for these rounds")
    calibrated: float = _value(
        1.0, "[px] that a camera is off by at most, as long as it is calibrated: so much is its fixed pattern's"
    )
    range_step: float = _value(0.08, "of the spread of the ranges in sight: a change of a range that matters")
    runs: int = _count(
        4, "simulated to validate a fit: by one, a cause that closes a few per cent of the floor is luck"
    )
    runs_of_subset: int = _count(2, "simulated of a sensor with some of the causes, for what each of them closes")
    most_work: int = _count(
        33_000_000_000,
        "pixels simulated, five for one whose rays are bent, three for one that is decimated: with more no further "
        "cause is looked for",
    )


class DepthSelect(Section):
    """Which candidates become causes. Shares are of the gap over its floor, on frames held out."""

    most_causes: int = _count(6, "causes that are named at most")
    first: float = _value(0.3, "that the first cause must close: less is a name that happens to be near")
    first_apart: float = _value(0.05, "that is enough for the first cause, if it also closes so many times the next")
    first_apart_times: float = _value(3.0, "what the next effect would close, see first_apart")
    further: float = _value(0.1, "that is enough for a further cause, whatever was left")
    further_of_left: float = _value(0.5, "of what was left, that is enough for a further cause")
    further_apart: float = _value(0.1, "of what was left, that is enough if `stays` of it stays beside any rival")
    beside_poses: float = _value(
        0.02, "that a cause must close beside errors of the poses: registered frames have some of these left"
    )
    least: float = _value(
        0.005, "that a cause must close beside a later one, or it is dropped, and more bias, noise or holes beside such"
    )
    stays: float = _value(
        0.7,
        "of what a further cause closes, that must stay where a rival is there before it: a true cause closes its own "
        "part, the residual of a misfit is one for all that could take it up",
    )
    left_alone: float = _value(
        0.3,
        "of how errors change along an axis of no other cause, that a further cause may leave which is named though "
        "rivals come near, if none of those acts where the gap lies",
    )
    of_one: float = _value(
        0.9, "of what an effect by material closes, that it must close by one material to be no leftover of a formula"
    )
    more_than_others: float = _value(
        1.5, "times the holes that most materials have: a material with more has some of its own"
    )
    rival: float = _value(0.25, "of what a further cause closes: effects that close less by themselves are no rivals")
    asked: int = _count(2, "times that an effect is refused, by itself and beside later causes, before it is left out")
    rounds: int = _count(3, "times that causes are looked for, when some are dropped at the end")
    trusted: int = _count(
        1, "times that a cause is taken for the moment, though it does not act where the gap lies yet"
    )
    beginnings: int = _count(2, "effects that are tried as the first cause, where something is left")
    better: float = _value(
        0.03, "of what is left, by which causes with another first one must leave less, and surely so"
    )
    nearest: float = _value(0.1, "that an effect must close to be reported as near, though it is no cause")
    most_nearest: int = _count(3, "effects that are reported as near at most")
    alike: float = _value(
        0.1, "of the whole gap, that a further cause must close where another makes the same error along the same axis"
    )
    flexible: int = _count(4, "parameters, with which an effect can take up much of what is another's")
    taken_up: float = _value(0.1, "of what it closes, by which a further cause must be ahead of a plainer one")
    tied: float = _value(0.01, "difference of what two close, below which they are ties, however sure it is")
    near: float = _value(0.15, "difference of what two close, above which they are no rivals for a tie")
    near_of_cause: float = _value(
        0.3,
        "the same as a part of what the better one closes; what is taken for the moment may have few parameters, "
        "and close so much less, in place of many",
    )
    harms: float = _value(
        0.3, "of what causes close on average, by which they may leave more in a block of frames, however unsure it is"
    )
    supposed: float = _value(
        0.25,
        "of the law of the noise that causes are looked for beside, where the simulator has none: with less of it, "
        "another noise made what showed",
    )


class DepthAgreement(Section):
    """Whether an effect acts where the gap lies. What a gap is made of: bias, noise, holes, tails."""

    acts: float = _value(0.25, "of what an effect does, that is of one kind, for which the effect must then answer")
    sure: float = _value(3.0, "times what chance changes along an axis, below which nothing does")
    uniform: float = _value(
        0.1, "of what a gap has of a kind: with less changing along any axis, it is the same all over"
    )
    uniform_tails: float = _value(0.25, "the same and `near_floor` of tails, which are counted in few pixels")
    all_along: float = _value(
        0.4, "of a gap: with so much changing along one axis, all kinds together, any cause must answer for that"
    )
    strong: float = _value(0.6, "of what changes along the first axis: with so much, an axis must not stay untouched")
    beside: float = _value(
        0.5,
        "of what changes along an axis of another cause: with so much along one of its own, or alike all along it, a "
        "cause is asked for that",
    )
    left_along: float = _value(0.5, "of what changes along the first axis, that a cause may leave")
    well: float = _value(
        0.8,
        "of a gap: a cause that closes so much may leave more along the axis that it is known by, up to `untouched`",
    )
    nearly_all: float = _value(
        0.95, "of a gap: causes that close so much need not act along the axis on which the gap lies first"
    )
    shape: float = _value(
        0.2, "of how holes change along the range, that a cause may leave which is known by nothing else, as others are"
    )
    left_by_flexible: float = _value(0.5, "of these two limits, for effects with many parameters")
    left_of_own: float = _value(
        0.25, "of what changes along the axis that it is known by, that an effect with many parameters may leave"
    )
    left_of_noise: float = _value(0.35, "the same for a noise that has few: other formulas left an eighth at most")
    left_by_exact: float = _value(
        0.05,
        "of how biases change along their first axis, that an effect may leave which is geometry; and of how holes do, "
        "that one may leave whose holes come in patches",
    )
    as_much: float = _value(
        0.85, "of what an axis of no cause explains, that one of its own must, for an effect with many parameters"
    )
    same: float = _value(
        0.95, "the same of a place in the picture: with so much, surfaces are at the same places there"
    )
    near_floor: float = _value(0.1, "of a kind of gap: with less left of it, it does not matter where that lies")
    mostly: float = _value(0.5, "of what is left: with so much along an axis that is none of a cause's, it lies there")
    untouched: float = _value(0.8, "of what changed along an axis: with so much left, a cause has no part in it")
    beside_pattern: float = _value(
        0.2, "of the biases: with so much untouched along an axis of no cause, no pattern that is learned is one"
    )
    together: float = _value(0.2, "of what an effect does: with more going together, it is no independent error")
    outliers_together: float = _value(
        0.1, "of the tails that it makes: with more, outliers come in patches; of right ones it was 0.04 at most"
    )
    waves: float = _value(
        8.0,
        "times what a simulated spectrum of errors rises: with more in the recording, they are waves and no noise",
    )
    seams: float = _value(
        0.1,
        "less agreement of neighbours across seams between blocks of pixels than elsewhere: with more than simulated, "
        "errors are a codec's and no noise",
    )
    locked: float = _value(
        0.2,
        "by which signs of errors at a pixel, or at a place in the scene, go together more than simulated ones: with "
        "more, noise is no cause",
    )
    shifted: float = _value(
        0.3,
        "by which the frames' mean signs of errors spread more than simulated ones: with more, noise is no cause",
    )
    brought_together: float = _value(
        0.03, "of a correlation of neighbours: one that is farther from the recording's by more is another's"
    )
    brought_nearer: float = _value(0.02, "of 1 less that: so much a filter must bring it nearer at least")
    idle: float = _value(
        0.02,
        "of what an effect does: more of its own along the axis that it is known by, or of spread along any of its, "
        "is no cause",
    )
    of_material: float = _value(
        0.08,
        "of what a factor of each material does: with less of it changing from one to another, it is none of theirs",
    )
    known_by: float = _value(
        0.05,
        "of what a bias or holes do, as an axis that they are known by shows it: with less of it changing along that, "
        "they are others",
    )
    inseparable: float = _value(
        0.01, "of what an effect does that makes several kinds of error together: with less of one, it is another"
    )
    many_holes: float = _value(0.03, "of the pixels: a sensor that loses so many anywhere never loses none")
    gone: float = _value(0.01, "of the pixels that the simulator loses: with less, they are all there")
    begins: float = _value(0.1, "of the pixels, where holes that grow along an axis are fewest: they begin there")
    beneath: float = _value(
        0.35, "of all holes over the simulator's, that are holes anywhere, if they lie where others begin"
    )
    flat: float = _value(
        0.2, "by which those may grow on to a quarter of the pixels; what grows has fewer there, by as much at least"
    )
    where_others_begin: float = _value(
        0.65, "of the holes that lie anywhere, and of those a quarter of the pixels farther on, that must be there, too"
    )
    by_itself: float = _value(
        0.3, "of the pixels that holes or tails change beside other causes, that they must change alone"
    )
    in_lines: float = _value(
        1.5, "times the variance of holes from row to row that a sensor has which loses pixels anywhere: more is lines"
    )
    outliers_in_lines: float = _value(5.0, "the same of outliers, some of which lie at edges, and these in columns")
    steps: float = _value(0.1, "bits by which the phases of disparities must differ for their steps to be wrong")
    brought: float = _value(
        0.01,
        "of the bias that an effect makes: more along one of its axes, along which the recording's changes less, is no "
        "cause's",
    )
    crossed: float = _value(0.02, "of a kind of gap: with less changing along two axes at once, they do not matter")
    left_of_uniform: float = _value(0.5, "of a kind that is the same all over, that a cause may leave")
    left_of_tails: float = _value(
        0.3, "the same of tails: outliers of another formula leave a seventh, other pictures and places two fifths"
    )


class DepthSignificance(Section):
    """What is more than chance.

    An excess is the logarithm of a gap over its floor, in units of the spread of that logarithm from run to run. It is
    no quantile of a known distribution. benchmarks/nulls.py counts how often recordings without a gap are above a
    threshold: of 17,280 scores (4 to 400 frames in four scenes, five profiles, 2,880 for each length) 99 % are below
    3.3 over all axes and 5.4 along the worst one, the largest are 7.2 and 10.2, and 0.03 % are above a threshold, at
    most 0.1 % of any length.
    """

    excess: float = _value(8.0, "over all axes, above which there is a gap")
    excess_along_axis: float = _value(8.0, "along one axis, above which there is a gap")
    where_fitted: float = _value(
        0.5, "of both, that what causes leave must be above on the frames that they were fitted on, to look for another"
    )
    least: float = _value(
        1e-4, "bits per pixel: less is no gap; two ray casters differ by 4e-6 to 4e-5, of sensors without noise"
    )
    faint: float = _value(0.1, "of the floor: less than this over it, and no cause, is no gap")
    runs: int = _count(16, "simulated of one sensor, to know how far two runs of it are apart")
    runs_resampled: int = _count(8, "of these that are taken when blocks of frames are left out in turn")
    spread_prior: float = _value(
        8.0, "runs that an axis' variance is drawn to the median of all by: of few, some come out far too small"
    )
    least_spread: float = _value(0.01, "of the logarithm of a gap: a smaller difference does not matter, however sure")
    least_spread_along_axis: float = _value(0.03, "the same along one axis")
    unknown: float = _value(
        1.0, "of a closed fraction, half of its interval: by more, frames say nothing of what a cause closes"
    )
    least_error: float = _value(0.01, "of a closed fraction, half of its interval: other frames differ by as much")


class DepthWhere(Section):
    """Where the gap lies."""

    per_doubling: float = _value(0.015, "of the gap, that an axis must explain more for having twice the cells")
    pair: float = _value(0.05, "the same for a pair of axes, or a finer look at one")
    paired: float = _value(2.2, "times the bits of single errors that pairs must show, as two independent ones show 2")
    together: float = _value(
        0.5,
        "of the bits of single errors that pairs must have of their own to go first; holes that go together: second",
    )
    beside: float = _value(0.2, "the same to go second")
    uniform: float = _value(0.1, "of the gap: where it changes along no axis by more, it may lie between neighbours")
    corrections: int = _count(3, "axes along which a correction is learned, besides those of neighbours")
    softening: float = _value(3.0, "pixels added to every histogram by its axis' own, for a correction that is learned")
    largest_weight: float = _value(20.0, "of a pixel in a correction that is learned")
    most_axes: int = _count(6, "axes that are reported at most")
    least_share: float = _value(0.02, "of the gap that must change along an axis for it to be reported")


class DepthCompare(Section):
    """Two recordings, compared without a simulator.

    The excess of `significance` is calibrated for runs that are simulated anew, and here there are none to simulate:
    the floor is from splits of the same blocks into halves that have as much of each recording. If nothing
    distinguishes the two, the split into A and B is one more of these, so by chance alone it is the largest in 1 of
    `splits` + 1; `above` and `ratio` ask for more than that, and benchmarks/nulls.py does not count them.
    """

    splits: int = _count(24, "into halves that have as much of each recording, for the floor")
    above: float = _value(4.0, "standard deviations of the splits that the gap must be above their mean")
    ratio: float = _value(1.1, "times the floor, that it must be above too")
    largest_weight: float = _value(10.0, "of a pixel, by what both recordings have seen")


class DepthConfig(Config):
    """The thresholds of :func:`depthsim.gap.diagnose` and of :func:`depthsim.gap.depth.compare.compare`."""

    data: DepthData = DepthData()
    fit: DepthFit = DepthFit()
    select: DepthSelect = DepthSelect()
    agreement: DepthAgreement = DepthAgreement()
    significance: DepthSignificance = DepthSignificance()
    where: DepthWhere = DepthWhere()
    compare: DepthCompare = DepthCompare()


class FlightData(Section):
    """What of a log is looked at, and how it is cut."""

    block: float = _value(2.5, "[s] of a block of time; residuals of real flights are correlated over about a second")
    folds: int = _count(9, "how many stretches of time are held out in turn")
    least_noise_accelerometer: float = _value(0.01, "[m/s²] the accelerometer is trusted no more than this")
    least_noise_velocities: float = _value(0.03, "[m/s²] differentiated velocities are trusted no more than this")
    longest_gap: float = _value(0.25, "[s] a log with a longer gap is cut there")
    shortest_piece: float = _value(6.0, "[s] pieces below this are left out")
    hover: float = _value(0.1, "[m/s] a flight whose velocity goes over no more than this is a hover")
    same_lag: float = _value(0.1, "how near a lag must be to that of the vehicle's motors to be theirs, relative")


class FlightSelect(Section):
    """Which effects the logs speak for."""

    most_causes: int = _count(6, "causes that are named at most")
    rounds: int = _count(2, "times that causes are looked for again, when some do not act where the gap lies")
    nearest: float = _value(0.1, "that an effect must close to be reported as near, though it is no cause")
    most_nearest: int = _count(3, "effects that are reported as near at most")
    further: float = _value(0.01, "of the gap's power, a tenth of its size, that is enough, whatever was left")
    further_of_left: float = _value(0.5, "of the power that was left, that is enough for a further cause")
    tie_t: float = _value(2.0, "difference of two losses over its standard error, below which they may be equal")
    tie_gain: float = _value(5.0, "difference of two losses below which they are equal")
    tie_share: float = _value(
        0.003, "of what an effect explains: a smaller difference belongs to how it is written, if that leaves as much"
    )
    noise_uncertainty: float = _value(0.1, "how well the noise's power is known, relative")
    unsure_gain: float = _value(30.0, "a loss that differs by less, and not in all blocks alike, does not differ")
    unsure_share: float = _value(0.05, "the same over what an effect explains")
    unsure_left: float = _value(5.0, "the same over what the candidate leaves")
    uneven_rotors: float = _value(
        0.25, "how far the force may speak of other uneven rotors than the logged thrusts, over what these differ by"
    )
    lasting: float = _value(
        0.85, "of what is learned in time: with so much on an axis that lasts, what varies is no wind"
    )
    lasting_by_found: float = _value(0.5, "the same where the vehicle has no drag of its own that carries a wind")
    like_wind: float = _value(0.6, "of what a free force in time closes: a wind closes so much, or it is none")
    velocities_show: float = _value(9.0, "of the loss: velocities that are noisier say nothing of gusts")
    gusts_share: float = _value(
        0.05, "of what is closed with a wind in time: candidates alone must leave this much more, or most of the rest"
    )
    varying_share: float = _value(0.005, "the same where a constant wind is among these candidates")


class FlightSignificance(Section):
    """What is more than chance, and what is only the nearest name."""

    least_gain: float = _value(22.0, "of the loss, which chance lowers by about 1 a parameter; the bank's size counted")
    least_t: float = _value(2.6, "mean gain of the blocks over its standard error")
    faint: float = _value(0.1, "of the floor: what can be learned on an axis and is less than this is no gap")
    least_axis: float = _value(0.05, "share of the power that must be learned on an axis for the gap to lie there")
    most_axes: int = _count(6, "axes that are reported at most")
    nearest: float = _value(
        0.015,
        "power that can still be learned over what a cause closes; above it the name may be the nearest only. Wrong "
        "names leave 0.02 to 0.1 in benchmarks/withheld_flight.py, right ones by another formula up to 0.01",
    )
    nearest_beside: float = _value(0.3, "the same beside a residual that is known to be there")
    left_of_all: float = _value(0.05, "of a gap's power: a cause that leaves less acts where it lies")
    left_along: float = _value(0.5, "of what lies along the axis of its own that has most, that a cause may leave")
    left_by_wind: float = _value(
        0.15, "of a gap's power: more that can be learned beside a wind in time, and it is none"
    )
    also: float = _value(0.8, "a force lies on every axis on which so much of it is learned, relative to the best")
    also_in_time: float = _value(0.6, "of what is learned in time, that counts for this")
    least_tilt: float = _value(0.01, "[rad] tilts below this are the attitude's own error")
    least_upward: float = _value(0.03, "[m/s²] upwards a tilt hardly matters")
    sensor_shared: float = _value(0.25, "of a sensor's error, what velocities may show at most")
    force_lacking: float = _value(0.6, "of a force, what velocities may lack at most")
    steady: float = _value(0.5, "of a cause's RMS: velocities are asked of causes whose mean is so large")
    main: float = _value(0.7, "of a cause's mean force: velocities speak against it where so much of it is")


class FlightConfig(Config):
    """The thresholds of :func:`depthsim.gap.flight.diagnose_flight`."""

    data: FlightData = FlightData()
    select: FlightSelect = FlightSelect()
    significance: FlightSignificance = FlightSignificance()
