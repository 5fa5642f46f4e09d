"""The causes of a gap with what each closes, and their parameters by name."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from depthsim.flight.table import Floats
from depthsim.gap.diagnosis import Cause, rounded
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.effect import Candidate
from depthsim.gap.flight.effects.wind import GustingWind
from depthsim.gap.flight.fit.advice import advice
from depthsim.gap.flight.fit.gusts import gust_parameters
from depthsim.gap.flight.fit.intervals import intervals
from depthsim.gap.flight.fit.optimize import Fit, refitted
from depthsim.gap.flight.fit.select import Selection, without
from depthsim.gap.flight.fit.series import Series
from depthsim.gap.resampling import block_weights, percentile95


def causes_of(
    problem: Problem, selection: Selection, floor: float, seed: int
) -> tuple[tuple[Cause, ...], list[float], tuple[float, float]]:
    """The causes, the one that closes most first; the gap before and after each [m/s²]; the 95 % interval of what all
    of them close, over blocks of time.
    """
    fit = selection.fit
    ladder = _ladder(selection)
    weights = block_weights(int(problem.reporting.sum()), seed=seed)
    rms = [_rms(problem, squares) for _, squares in ladder]
    draws = [_rms(problem, squares, weights) for _, squares in ladder]
    found, spans = [], intervals(fit, seed)
    for step, (index, _) in enumerate(ladder[1:], start=1):
        closed = float(_portion(rms, step, floor))
        interval = rounded(percentile95(_portion(draws, step, floor)))
        if index is None:
            assert selection.gusts is not None
            found.append(_gust_cause(problem, selection.gusts, closed, interval, seed))
            continue
        candidate, values = fit.candidates[index], fit.values[index]
        alternatives = tuple(selection.alternatives[index]) if selection.alternatives else ()
        ends = spans[index]
        parameters = {"formula": candidate.name, **_named(candidate, values, problem)}
        low, high = (_named(candidate, one.tolist(), problem) for one in ends)
        found.append(
            Cause(
                effect=candidate.effect,
                parameters=parameters,
                ci95={
                    name: (low[name], high[name])
                    if not isinstance(low[name], list)
                    else list(zip(low[name], high[name], strict=True))
                    for name in low
                },
                closed_fraction=rounded(closed),
                ci95_closed=interval,
                indistinguishable_from=alternatives,
                advice=advice(candidate.effect, alternatives),
            )
        )
    return tuple(found), rms, rounded(percentile95(closed_share(draws[0], draws[-1], floor)))


def _ladder(selection: Selection) -> list[tuple[int | None, Floats]]:
    """Squared residuals (B,) of the blocks reported on, with one cause more each time, the strongest first."""
    fit = selection.fit
    count = len(fit.candidates)
    without_each = [_first(without(fit, index)).sum() for index in range(count)] if count > 1 else [0.0] * count
    order: list[int | None] = [int(index) for index in np.argsort(without_each, kind="stable")[::-1]]
    if selection.gusts is not None:
        gusty = float(((fit.held_out[:, 0] + selection.gusts.predicted[:, 0]) ** 2).sum())
        order.insert(sum(1 for index in order if index is not None and without_each[index] > gusty), None)
    found: list[tuple[int | None, Floats]] = [(None, _first(selection.start))]
    taken: list[int] = []
    calm = False
    for index in order:
        calm = calm or index is None
        taken += [] if index is None else [index]
        problem = fit.problem if calm else selection.start.problem
        candidates = [fit.candidates[place] for place in taken]
        values = tuple(fit.values[place] for place in taken)
        step = (
            fit if len(taken) == count and (calm or selection.gusts is None) else refitted(problem, candidates, values)
        )
        found.append((index, _first(step)))
    return found


def _first(fit: Fit) -> Floats:
    return np.asarray(fit.squares[fit.problem.reporting, 0].sum(axis=-1))


def _rms(problem: Problem, squares: Floats, weights: Floats | None = None) -> Any:
    counts = problem.counts[problem.reporting] * len(problem.records.axes)
    if weights is None:
        return float(np.sqrt(squares.sum() / counts.sum()))
    return np.sqrt((weights @ squares) / (weights @ counts))


def _portion(rms: Sequence[Any], step: int, floor: float) -> Any:
    """What one of several causes closes: its part of the power, as a part of what all of them close.

    Of two equal forces the first to go would lower an RMS by less than the second; shares of power are alike.
    """
    power = (rms[step - 1] ** 2 - rms[step] ** 2) / np.maximum(rms[0] ** 2 - rms[-1] ** 2, 1e-12)
    return np.clip(power * (rms[0] - rms[-1]) / np.maximum(rms[0] - floor, 1e-9), -1.0, 1.0)


def closed_share(before: Any, after: Any, floor: float) -> Any:
    """(before - after) / (before - floor), of figures or of draws of them."""
    return np.clip((before - after) / np.maximum(before - floor, 1e-9), -1.0, 1.0)


def _named(candidate: Candidate, values: Sequence[float], problem: Problem) -> dict[str, Any]:
    """Parameters by name, as the candidate has them reported."""
    if candidate.named is not None:
        return rounded(candidate.named(values, problem.records, problem.base))
    return rounded({parameter.name: value for parameter, value in zip(candidate.parameters, values, strict=True)})


def _gust_cause(problem: Problem, series: Series, closed: float, interval: tuple[float, float], seed: int) -> Cause:
    keys, spans = gust_parameters(problem, series, seed)
    return Cause(
        effect=GustingWind.id,
        parameters={"formula": "wind that changes in time", **keys},
        ci95=spans,
        closed_fraction=rounded(closed),
        ci95_closed=interval,
        advice=advice(GustingWind.id, ()),
    )
