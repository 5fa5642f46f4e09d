"""From logs and a vehicle to a diagnosis: where the forces differ, which effects cause it, how far they close it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from depthsim.errors import InputError
from depthsim.flight.log import FlightLog
from depthsim.flight.table import Floats
from depthsim.flight.vehicle import Vehicle
from depthsim.gap.config import FlightConfig
from depthsim.gap.diagnosis import Diagnosis, Gap, Nearest, Unexplained, rounded
from depthsim.gap.flight.data.axes import state_of
from depthsim.gap.flight.data.evidence import Problem, make_problem, with_noise
from depthsim.gap.flight.data.records import prepare
from depthsim.gap.flight.data.settings import base_settings, with_settings
from depthsim.gap.flight.data.simulate import Model, Settings
from depthsim.gap.flight.effect import Candidate, flight_effect_ids
from depthsim.gap.flight.effects.thrust import ThrustLag
from depthsim.gap.flight.effects.wind import GustingWind
from depthsim.gap.flight.findings import Findings, learn_all, power, stands_out
from depthsim.gap.flight.fit.agreement import blows, objections, only
from depthsim.gap.flight.fit.candidates import bank, left_out
from depthsim.gap.flight.fit.causes import causes_of, closed_share
from depthsim.gap.flight.fit.gusts import gust_parameters
from depthsim.gap.flight.fit.intervals import intervals
from depthsim.gap.flight.fit.optimize import empty_fit
from depthsim.gap.flight.fit.select import Progress, Selection, select
from depthsim.gap.flight.where.correction import Learned
from depthsim.gap.flight.where.localize import cuts
from depthsim.gap.selection import Refused, nearest_in_words, verdict_of

_CUTOFF_WORDS = "4 Hz low-pass on both sides, per axis of the body, on time held out"


def investigate(
    logs: Sequence[FlightLog],
    vehicle: Vehicle,
    without: Sequence[str] = (),
    seed: int = 0,
    say: Progress = lambda _: None,
    config: FlightConfig = FlightConfig(),  # noqa: B008 - frozen
) -> Findings:
    """Diagnose flights of a vehicle; see :func:`depthsim.gap.flight.diagnose_flight`."""
    unknown = [name for name in without if name not in flight_effect_ids()]
    if unknown:
        raise InputError(
            "`without`", unknown[0], "is no effect of a flight", f"name one of {', '.join(flight_effect_ids())}"
        )
    say("reading forces")
    records = prepare(logs, vehicle, config)
    base = base_settings(vehicle, [log.duration for log in logs])
    problem, notes = make_problem(records, Model(vehicle), base, config), [*records.notes, *left_out(records)]
    candidates = bank(records, problem.base, vehicle.rotors.radius, without)
    say("noise and axes")
    gusts = GustingWind.id not in without
    selection = select(empty_fit(problem), candidates, gusts, say)
    quieter = with_noise(problem, selection.fit.settings)
    if (quieter.sigma < 0.8 * problem.sigma).any():
        problem = quieter
        selection = select(empty_fit(problem), candidates, gusts, say)
    command = _as_command(problem, selection, vehicle)
    if command is not None:
        problem = command
        lag = vehicle.rotors.motor_time_constant
        notes.append(
            f"the thrust in the log is read as a command, which the motors follow with the vehicle's {lag:g} s"
        )
        candidates = bank(records, problem.base, vehicle.rotors.radius, without)
        selection = select(empty_fit(problem), candidates, gusts, say)
    return _agreed(problem, candidates, selection, vehicle, seed, notes, gusts, say)


def _agreed(
    problem: Problem,
    candidates: Sequence[Candidate],
    selection: Selection,
    vehicle: Vehicle,
    seed: int,
    notes: list[str],
    gusts: bool,
    say: Progress,
) -> Findings:
    """The findings, once every cause acts where the gap lies; what does not is looked at no more, and others are."""
    refused = Refused()
    trusted: set[str] = set()
    for turn in range(problem.config.select.rounds + problem.config.select.most_causes):
        say("what is left")
        found = _findings(problem, selection, vehicle, seed, notes, refused)
        wrong, calm = objections(found, trusted), selection.gusts is not None and not blows(found)
        if not wrong and not calm:
            break
        gusts = gusts and not calm
        effects = selection.fit.effects
        closed = {cause.effect: cause.closed_fraction for cause in found.diagnosis.causes}
        for index, why in wrong.items():
            refused.refuse(effects[index], closed[effects[index]], why)
            say(f"{effects[index]} is no cause: it {why}")
        kept = tuple(index for index in range(len(effects)) if index not in wrong)
        trusted |= {effects[index] for index in kept}
        if turn < problem.config.select.rounds:
            selection = select(selection.start, [c for c in candidates if c.effect not in refused], gusts, say)
        else:
            selection = only(selection, kept)
    return found


def _as_command(problem: Problem, selection: Selection, vehicle: Vehicle) -> Problem | None:
    """The problem with the log's thrust read as the motors' command.

    A log may have either under one name. Where all that is found is the lag that the vehicle's motors have anyway, the
    log has the commands, and that is no gap.
    """
    lag = vehicle.rotors.motor_time_constant
    fit = selection.fit
    if fit.effects != (ThrustLag.id,) or problem.base.lag or selection.gusts is not None or not lag:
        return None
    found = fit.values[0][0] * (1 + (fit.values[0][1] if len(fit.values[0]) > 1 else 0.0))
    low, high = intervals(fit)[0][:, 0]
    if abs(found - lag) > max(problem.config.data.same_lag * lag, 0.5 * float(high - low)):
        return None
    commanded = replace(problem, base=replace(problem.base, lag=lag))
    return with_noise(commanded, commanded.base)


def _findings(
    problem: Problem,
    selection: Selection,
    vehicle: Vehicle,
    seed: int,
    notes: list[str],
    refused: Refused,
) -> Findings:
    fit, start = selection.fit, selection.start
    reported, rows = problem.reported, problem.reported_rows
    noise = np.minimum(reported.noise(fit.settings)[0], reported.noise(problem.base)[0])
    before, after = start.residual[rows, 0], fit.held_out[rows, 0]
    noise = np.minimum(noise, np.sqrt(np.minimum((before**2).mean(axis=0), (after**2).mean(axis=0))))
    floor = float(np.sqrt((noise**2).mean()))
    causes, steps, interval = causes_of(problem, selection, floor, seed)
    state = state_of(reported, problem.base)
    learned = learn_all(reported, before, problem.base, noise)
    left = learn_all(reported, after, fit.settings, noise)
    gap_power, rest_power = power(before, noise), power(after, noise)
    there = [one for one in learned if stands_out(one, gap_power, noise, problem.config)]
    unnamed = [one for one in left if stands_out(one, rest_power, noise, problem.config)]
    gap = bool(causes) or bool(there)
    near = refused.nearest([cause.effect for cause in causes], problem.config.select)
    figures = steps[0], steps[-1], floor
    unexplained = _unexplained(reported, after, fit.settings, unnamed, noise, figures, near) if gap else None
    where = cuts(reported, before, state, there, noise) if gap else ()
    diagnosis = Diagnosis(
        verdict=verdict_of(bool(causes), unexplained) if gap else "no_gap",
        gap=Gap(
            measure=f"RMS of the specific force that the model misses ({problem.records.channels[0]}; {_CUTOFF_WORDS})",
            unit="m/s²",
            before=rounded(steps[0]),
            after=rounded(steps[-1]),
            floor=rounded(floor),
            closed_fraction=rounded(float(closed_share(*figures))),
            ci95=interval,
        ),
        where=where,
        causes=causes,
        unexplained=unexplained,
        notes=tuple(notes),
    )
    gusts = gust_parameters(problem, selection.gusts)[0] if selection.gusts is not None else None
    return Findings(
        diagnosis, with_settings(vehicle, fit.settings, gusts), reported, selection, before, after, noise, state,
        tuple(learned), tuple(left),
    )  # fmt: skip


def _unexplained(
    problem: Problem,
    residual: Floats,
    s: Settings,
    unnamed: list[Learned],
    noise: Floats,
    figures: tuple[float, float, float],
    nearest: tuple[Nearest, ...],
) -> Unexplained | None:
    if not unnamed:
        return None
    before, after, floor = figures
    fraction = float(np.clip((after - floor) / max(before - floor, 1e-9), 0.0, 1.0))
    where = cuts(problem, residual, state_of(problem, s), unnamed, noise)
    first = unnamed[0]
    left = float(np.sqrt((first.residual**2).mean()))
    learnable = float(np.clip((after - left) / max(before - floor, 1e-9), 0.0, 1.0))
    text = (
        f"No effect of the bank closes {fraction:.0%} of the gap. It goes with {_words(unnamed)}; a correction learned "
        f"on {first.axis.replace('_', ' ')} would close {learnable:.0%} of the gap on time held out."
        f"{nearest_in_words(nearest)}"
    )
    return Unexplained(
        fraction=rounded(fraction), where=where, description=text, learnable=rounded(learnable), nearest=nearest
    )


def _words(unnamed: list[Learned]) -> str:
    return ", then ".join(one.axis.replace("_", " ") for one in unnamed[:3])
