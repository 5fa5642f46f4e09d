"""Further tiers of the withheld benchmark of flights: pairs, winds of five forms, and the intervals of parameters."""

import time

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.withheld_flight import EFFECTS, WINDS, Case, further, is_of, share, the_vehicle
from benchmarks.withheld_flight_data import MASS, Noise, Truth, flight, random_path
from benchmarks.withheld_flight_wind import FORMS, gusts_of, mean_of, wind
from depthsim.flight.log import FlightLog
from depthsim.gap.config import FlightConfig
from depthsim.gap.flight import investigate

PAIRS = (
    ("rotor_drag", "thrust_scale"), ("constant_wind", "imu_bias"), ("body_drag_quadratic", "imu_misalignment"),
    ("thrust_lag", "ground_effect"), ("gusting_wind", "thrust_scale"), ("rotor_drag", "constant_wind"),
    ("vertical_damping", "imu_bias"), ("mass", "imu_misalignment"),
)  # fmt: skip
EVEN, UNEVEN = (1.0, 1.0), (2.0, 0.3)
GUSTS = "gusting_wind"
HALF_RHO = 0.5 * 1.225


def _logged(rng: np.random.Generator, kind: str, truth: Truth, seed: int) -> FlightLog:
    path = random_path(rng, kind, low=True)
    noise = Noise(float(rng.uniform(0.05, 0.3)), attitude=float(rng.uniform(0.0, 0.004)))
    return flight(path, truth, noise, seed)


def _diagnosed(effects: tuple[str, ...], log: FlightLog, config: FlightConfig) -> Case:
    begin = time.process_time()
    found = investigate([log], the_vehicle("rotor_drag" not in effects), config=config)
    return Case(effects, "", found, time.process_time() - begin)


def pairs(console: Console, logs: int, seed: int, source: str, config: FlightConfig) -> None:
    """Two effects, alike in strength, or one about seven times the other; either may be the small one."""
    by_name = {effect.name: effect for effect in EFFECTS}
    for title, sizes in (("alike", EVEN), ("very different in size", UNEVEN)):
        table = Table("pair", "both named", "a wrong one too", "closed, median", title=f"Two effects, {title}")
        both, clean, total = 0, 0, 0
        for number, names in enumerate(PAIRS):
            cases = []
            for index in range(logs):
                place = seed + 70_000 + 100 * number + index
                rng = np.random.default_rng(place)
                kinds = [kind for kind in by_name[names[0]].paths if kind in by_name[names[1]].paths]
                order = sizes if index % 2 == 0 else sizes[::-1]
                truth = Truth()
                for name, size in zip(names, order, strict=True):
                    truth = truth.plus(by_name[name].make(rng, size))
                cases.append(
                    _diagnosed(names, _logged(rng, kinds[int(rng.integers(len(kinds)))], truth, place), config)
                )
            found = [_all_named(case) for case in cases]
            wrong = [bool(further(case)) for case in cases]
            both, clean, total = both + sum(found), clean + wrong.count(False), total + len(cases)
            closed = np.median([case.found.diagnosis.gap.closed_fraction for case in cases])
            table.add_row(" + ".join(names), f"{sum(found)} of {len(found)}", str(sum(wrong)), f"{closed:.2f}")
        console.print(table)
        console.print(
            f"both named, {title}: {share(both, total)}; aim 80 %; no wrong one: {share(clean, total)}; aim 95 %"
        )


def _all_named(case: Case) -> bool:
    return all(any(is_of((name,), cause) for cause in case.found.diagnosis.causes) for name in case.effects)


def winds(console: Console, logs: int, seed: int, source: str, config: FlightConfig) -> None:
    """Five forms on five paths; named is whether the first cause is a wind, near whether its mean is within 15 %."""
    table = Table("form", "named", "mean within 15 %", "closed, median", "other causes", title="Winds of five forms")
    named, near, total = 0, 0, 0
    inside: dict[str, list[bool]] = {}
    for number, form in enumerate(FORMS):
        rows = []
        for path in ("hover", "circle", "lemniscate", "shuttle", "hops"):
            for index in range(max(logs // 2, 1)):
                place = seed + 30_000 + 1000 * number + 10 * index + len(path)
                rng = np.random.default_rng(place)
                truth = wind(rng, form)
                case = _diagnosed(("constant_wind",), _logged(rng, path, truth, place), config)
                rows.append((case, _mean_error(case, truth)))
                for cause in case.found.diagnosis.causes:
                    gusts = case.found.selection.gusts
                    if cause.effect == GUSTS and gusts is not None:
                        for name, values in gusts_of(truth, gusts.time[0], gusts.time[-1]).items():
                            inside.setdefault(name, []).extend(_covered(cause.ci95, {name: values}))
        ok = [bool(case.first) and case.found.diagnosis.causes[0].effect in WINDS for case, _ in rows]
        close = [error < 0.15 for _, error in rows]
        closed = np.median([case.found.diagnosis.gap.closed_fraction for case, _ in rows])
        others = sum(bool(further(case)) for case, _ in rows)
        named, near, total = named + sum(ok), near + sum(close), total + len(rows)
        table.add_row(form, f"{sum(ok)} of {len(ok)}", str(sum(close)), f"{closed:.2f}", str(others))
    console.print(table)
    console.print(f"a wind named first: {share(named, total)}; aim 95 %; its mean within 15 %: {share(near, total)}")
    for name, covered in inside.items():
        console.print(f"    95 % intervals of {name} that hold the truth: {share(sum(covered), len(covered))}")


def _mean_error(case: Case, truth: Truth) -> float:
    """Of the mean wind that is reported, relative; infinite without one."""
    for cause in case.found.diagnosis.causes:
        if cause.effect in WINDS:
            p = cause.parameters
            seen = np.array(p["velocity"][:2] if "velocity" in p else [p["x"], p["y"]])
            mean = mean_of(truth)
            return float(np.linalg.norm(seen - mean) / np.linalg.norm(mean))
    return np.inf


def _known(rng: np.random.Generator, k: float) -> tuple[tuple[str, str, Truth, dict[str, list[float]]], ...]:
    """Effects by formulas whose parameters the report has too: name, path, truth, and its parameters by name."""
    w, bias, tilt = rng.uniform(-3, 3, 2) * k, rng.uniform(-0.2, 0.2, 3) * k, rng.uniform(-0.02, 0.02, 3) * k
    turn = (float(tilt[0]), float(tilt[1]), float(tilt[2]))
    lag, ends = 0.05 + 0.03 * k, [-one for one in turn]  # the truth turns the force, the report the sensor
    return (
        ("constant_wind", "lemniscate", Truth(wind=np.array([[*w, 0.0]] * 2)), {"x": [w[0]], "y": [w[1]]}),
        ("vertical_damping", "shuttle", Truth({"climb": 0.4 * k}), {"D_z": [0.4 * k]}),
        ("body_drag_quadratic", "lemniscate", Truth({"quad_all": 0.02 * k}), {"A": [0.02 * k / HALF_RHO]}),
        ("mass", "lemniscate", Truth({"mass": MASS * (1 + 0.05 * k)}), {"mass": [MASS * (1 + 0.05 * k)]}),
        ("thrust_scale", "hops", Truth(rotors=(1 + 0.04 * k,) * 4), {"scale": [1 + 0.04 * k]}),
        ("thrust_lag", "hops", Truth({"lag": lag}, logs_command=True), {"time_constant": [lag]}),
        ("ground_effect", "hops", Truth({"ground_exp": 0.15 * k, "ground_height": 0.25}),
         {"strength": [0.15 * k], "height": [0.25]}),
        ("imu_bias", "circle", Truth(bias=(float(bias[0]), float(bias[1]), float(bias[2]))), {"bias": bias.tolist()}),
        ("imu_misalignment", "lemniscate", Truth(tilt=turn), {"x": ends[:1], "y": ends[1:2], "z": ends[2:]}),
        ("log_time_offset", "hops", Truth(late={"imu": 0.03 * k}), {"seconds": [0.03 * k]}),
    )  # fmt: skip


def intervals(console: Console, logs: int, seed: int, source: str, config: FlightConfig) -> None:
    """How many of the reported 95 % intervals hold the parameter that the flight was made with."""
    inside: dict[str, list[bool]] = {}
    for index in range(2 * logs):
        for number in range(len(_known(np.random.default_rng(0), 1.0))):
            place = seed + 20_000 + 100 * number + index
            rng = np.random.default_rng(place)
            name, path, truth, values = _known(rng, float(rng.uniform(0.7, 2)))[number]
            case = _diagnosed((name,), _logged(rng, path, truth, place), config)
            for cause in case.found.diagnosis.causes:
                if cause.effect == name:
                    inside.setdefault(name, []).extend(_covered(cause.ci95, values))
    table = Table("effect", "covered", title="95 % intervals that hold the truth")
    for name, covered in inside.items():
        table.add_row(name, f"{sum(covered)} of {len(covered)}")
    console.print(table)
    every = [one for covered in inside.values() for one in covered]
    console.print(f"intervals that cover: {share(sum(every), len(every))}; aim 90 to 98 %")


def _covered(found: dict[str, object], values: dict[str, list[float]]) -> list[bool]:
    """For every parameter that both have."""
    out = []
    for name, truths in values.items():
        if name in found:
            ends = np.reshape(np.array(found[name], dtype=float), (-1, 2))
            ends = ends[: len(truths)]  # of a wind the part upwards is none that was fitted
            out += [bool(low <= truth <= high) for truth, (low, high) in zip(truths, ends, strict=True)]
    return out
