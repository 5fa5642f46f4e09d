"""All thresholds of the diagnoses, documented and frozen, so that a benchmark can vary them: ``diagnose(config=...)``.

What is measured (histogram bins, the cells of the axes, the measure itself) is no threshold, and stands with its code.
"""

from pydantic import BaseModel, ConfigDict, Field


class Section(BaseModel):
    """Some thresholds that go together."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def _value(default: float, about: str) -> float:
    field: float = Field(default, description=about)
    return field


def _count(default: int, about: str) -> int:
    field: int = Field(default, description=about)
    return field


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
    least_share: float = _value(0.01, "of the gap's power, a tenth of its size: less is not worth a name")
    tie_t: float = _value(2.0, "difference of two losses over its standard error, below which they may be equal")
    tie_gain: float = _value(5.0, "difference of two losses below which they are equal")
    tie_share: float = _value(
        0.003, "of what an effect explains: a smaller difference belongs to its formula, if that leaves as much"
    )
    noise_uncertainty: float = _value(0.1, "how well the noise's power is known, relative")
    unsure_gain: float = _value(30.0, "a loss that differs by less, and not in all blocks alike, does not differ")
    unsure_share: float = _value(0.05, "the same over what an effect explains")
    unsure_left: float = _value(5.0, "the same over what the formula leaves")
    uneven_rotors: float = _value(
        0.25, "how far the force may speak of other uneven rotors than the logged thrusts, over what these differ by"
    )
    lasting_motion: float = _value(
        0.75, "of what is learned in time: so much on acceleration, angular rate or thrust, and it is no gust"
    )
    lasting: float = _value(0.5, "the same on any other axis that lasts")
    formula: float = _value(0.85, "of what gusts close: where a formula closes so much, it is the formula")
    like_wind: float = _value(0.6, "of what a free force in time closes: a wind closes so much, or it is none")
    velocities_tell: float = _value(9.0, "of the loss: velocities that are noisier say nothing of gusts")
    gusts_share: float = _value(0.05, "of what is closed with gusts: formulas alone must leave this much more")


class FlightSignificance(Section):
    """What is more than chance, and what is only the nearest name."""

    least_gain: float = _value(22.0, "of the loss, which chance lowers by about 1 a parameter; the bank's size counted")
    least_t: float = _value(2.6, "mean gain of the blocks over its standard error")
    rest: float = _value(0.006, "of the gap's power: a rest below this is not reported")
    rest_of_gusts: float = _value(0.05, "the same where the wind gusts: between knots a little is always left")
    least_axis: float = _value(0.05, "share of the power that must be learned on an axis for the gap to lie there")
    most_axes: int = _count(6, "axes that are reported at most")
    nearest: float = _value(
        0.015,
        "power that can still be learned over what a cause closes; above it the name may be the nearest only. Wrong "
        "names leave 0.02 to 0.1 in benchmarks/withheld_flight.py, right ones by another formula up to 0.01",
    )
    nearest_beside: float = _value(0.3, "the same beside a rest that is known to be there")
    also: float = _value(0.8, "a force lies on every axis on which so much of it is learned, relative to the best")
    least_tilt: float = _value(0.01, "[rad] tilts below this are the attitude's own error")
    least_upward: float = _value(0.03, "[m/s²] upwards a tilt hardly matters")
    sensor_shared: float = _value(0.25, "of a sensor's error, what velocities may show at most")
    force_lacking: float = _value(0.6, "of a force, what velocities may lack at most")
    steady: float = _value(0.5, "of a cause's RMS: velocities are asked of causes whose mean is so large")
    main: float = _value(0.7, "of a cause's mean force: velocities speak against it where so much of it is")


class FlightConfig(Section):
    """The thresholds of :func:`depthsim.gap.flight.diagnose_flight`."""

    data: FlightData = FlightData()
    select: FlightSelect = FlightSelect()
    significance: FlightSignificance = FlightSignificance()
