"""A fit in sentences: what is known, what is not, and why."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from depthsim.flight.fit.fit import DragFit, LawFit
from depthsim.flight.fit.thrust import ThrustMap
from depthsim.flight.log import FlightLog

_ABOUT = 0.1
"""The exponent is that of a tangent at the mean thrust, and a turning vehicle's rotors add to it: 0.45 is still √T."""
_ROTOR_BY_ROTOR = {"rotor_sqrt", "rotor_linear_each", "rotor_linear_difference"}


def residual(fit: DragFit) -> str:
    """What was compared."""
    source = "from the accelerometer" if fit.measured else "from differentiated velocities"
    return f"lateral specific force in the body frame, {source}, {fit.cutoff:g} Hz low-pass without delay on both sides"


def offsets(fit: DragFit) -> str:
    """What the columns of the table call removed, start and kept."""
    return (
        "Each flight has an offset of its own between the measured force and the model (accelerometer bias, mounting). "
        "On a flight that was not fitted it is: removed = taken out of the whole flight; start = found on its first "
        "5 s in the air, the rest counts; kept = unknown, and counts as error."
    )


def thrust_map(found: ThrustMap) -> str:
    """The map as a formula, with how well it does."""
    low, high = found.ci95
    terms = " ".join(
        f"{value:+.4g} (95 %: {below:.3g} to {above:.3g}) u{'²' if power == 2 else ''}"
        for power, value, below, above in zip(found.powers, found.coefficients, low, high, strict=True)
    )
    error = ""
    if found.error is not None and found.scaled_error is not None:
        error = f"; {found.error:.3f} m/s² RMSE on unseen flights, {found.scaled_error:.3f} with the scale of each"
    given = f"u = {found.input.formula}, mean {found.hover:.4g}"
    return f"Thrust map: thrust of a rotor over mass = {terms.removeprefix('+')} m/s², {given}{error}."


def notes(fit: DragFit, logs: Sequence[FlightLog]) -> list[str]:
    """All that should be known before the figures are believed."""
    return [*_ties(fit), *_unknown(fit), *_scales(fit), *_logs(fit, logs)]


def _ties(fit: DragFit) -> list[str]:
    found = []
    if "none" in (fit.best, *fit.ties):
        found.append("no drag is seen: no law does better on unseen flights than none")
    if fit.ties:
        found.append(f"a tie: {', '.join((fit.best, *fit.ties))} do equally well on unseen flights")
    exponent = fit.exponent
    if exponent is not None:
        span = f"drag ∝ T^{exponent.value:.2f} (95 %: {exponent.low:.2f} to {exponent.high:.2f})"
        varies = f"thrust varies by {exponent.variation:.1%} of its mean"
        low, high = exponent.low - _ABOUT, exponent.high + _ABOUT
        linear, rotor = low <= 0 <= high, low <= 0.5 <= high
        if linear and rotor:
            found.append(
                f"{varies}, so kT + b is constant within {exponent.variation / 2:.1%}, and these flights cannot "
                f"distinguish linear drag from rotor drag, nor k from b: {span}; fast turns and climbs would"
            )
        else:
            law = "linear drag" if linear else "rotor drag, √T or kT + b" if rotor else "neither linear nor rotor drag"
            found.append(f"{varies}, and {span} agrees with {law}")
    return found


def _unknown(fit: DragFit) -> list[str]:
    found = []
    for law in fit.laws:
        for name, along, known in zip(law.law.names, law.law.along, law.known, strict=True):
            if not known:
                why = "no thrust in the log" if along == 2 and fit.per_flight[0].scale is None else "no motion along it"
                found.append(f"{law.law.name}: {name} is not known ({why}) and written as 0")
        found.extend(_signs(law))
    if fit.thrust_from != "the log, rotor by rotor" and _ROTOR_BY_ROTOR & {fit.best, *fit.ties}:
        source = {"the thrust map": "is the thrust map's", "the log, in all": "is in equal parts"}
        how = source.get(fit.thrust_from, "is the accelerometer's, in equal parts")
        found.append(f"the thrust of the single rotors {how}: Eq. 6 to 12 are hardly distinguishable from Eq. 13")
    return found


def _signs(law: LawFit) -> list[str]:
    zero = [
        name
        for name, low, high, known in zip(law.law.names, law.low, law.high, law.known, strict=True)
        if known and low <= 0 <= high
    ]
    below = [name for name, high, known in zip(law.law.names, law.high, law.known, strict=True) if known and high < 0]
    found = [f"{law.law.name}: {', '.join(zero)} indistinguishable from 0"] if zero else []
    if below:
        found.append(
            f"{law.law.name}: {', '.join(below)} is below 0, which no drag is, and written as 0: check the axes"
        )
    return found


def _scales(fit: DragFit) -> list[str]:
    found = []
    sides = {
        "model": [part.offset for part in fit.per_flight],
        "velocities": [part.against_velocity for part in fit.per_flight if part.against_velocity is not None],
    }
    for other, offset in sides.items():
        if offset:
            low, high = np.min(offset, axis=0), np.max(offset, axis=0)
            span = f"x {low[0]:+.3f} to {high[0]:+.3f}, y {low[1]:+.3f} to {high[1]:+.3f} m/s²"
            found.append(f"offsets of the measured force against the {other}, by flight: {span}")
    scales = np.array([part.scale for part in fit.per_flight if part.scale is not None])
    if scales.size and fit.thrust_map is None:
        found.append(
            f"mass × specific force along z is {scales.mean():.3f} of the log's thrust: the mass and the scales of "
            "the thrust and of the accelerometer are indistinguishable"
        )
    if scales.size > 1:
        found.append(f"the scale of the thrust differs by {scales.std(ddof=1):.1%} from flight to flight")
    if fit.thrust_map is not None:
        found.append("without a force sensor the thrust map is thrust over mass; in N it is as wrong as the mass")
    return found


def _logs(fit: DragFit, logs: Sequence[FlightLog]) -> list[str]:
    found = []
    if len(fit.per_flight) == 1:
        found.append("one flight only: it was judged by leaving out quarters of it in turn; more flights show more")
    if not fit.measured and any(log.specific_force is not None for log in logs):
        found.append("not every log has an accelerometer, so all forces are from velocities")
    for what in ("left_out", "derived"):
        by_columns: dict[tuple[str, ...], list[str]] = {}
        for log in logs:
            by_columns.setdefault(getattr(log, what), []).append(Path(log.source).name)
        for columns, names in by_columns.items():
            which = names[0] if len(names) == 1 else f"{len(names)} logs"
            if columns:
                found.append(f"{which}: {', '.join(columns)} {'not used' if what == 'left_out' else ''}".rstrip())
    return found
