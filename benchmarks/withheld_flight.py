"""Whether the diagnosis of flights finds what was withheld from it; tables with Wilson's 95 % intervals.

./run python benchmarks/withheld_flight.py [--logs 4] [--seed 1000] [--tier single,unknown,none,pairs,wind,...]

Flights are made by a simulator of the benchmark's own (withheld_flight_data.py). ``single``: one effect is in the
flight and not in the vehicle. ``unknown``: and it is left out of the bank too, with all that do the same to a log.
``pairs``: two effects, as strong as each other and one much weaker. ``none``: the vehicle is right. ``wind``: of five
forms. ``intervals``: whether they cover the truth. ``real``: NanoBench, from no drag with a thrust map fitted.
"""

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path as File

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(File(__file__).resolve().parents[1]))

from benchmarks import withheld_flight_inverse as inverse
from benchmarks.thresholds import HELP
from benchmarks.withheld_flight_data import (
    ARM,
    BASE_DRAG,
    INERTIA,
    MASS,
    MOTOR_LAG,
    RADIUS,
    TORQUE,
    Noise,
    Truth,
    flight,
    random_path,
    with_columns,
)
from benchmarks.withheld_score.score import wilson
from depthsim.flight.log import FlightLog
from depthsim.flight.vehicle import Vehicle, load_vehicle
from depthsim.gap.config import FlightConfig
from depthsim.gap.diagnosis import Cause
from depthsim.gap.flight import Findings, investigate

FLIGHTS = File(__file__).resolve().parents[2] / "shared" / "data" / "flight_nanobench"
STRENGTHS = ("weak", "medium", "strong")
VISIBLE = 0.5
"""A gap is counted where the log has it: above this share of the noise."""
Rng = np.random.Generator
Floats = np.ndarray


@dataclass(frozen=True)
class Effect:
    """A withheld effect. make: its truth from a strength (1 is medium). paths: where it shows. axes: the right ones.
    alike: what must leave the bank with it, since it does the same to a log."""

    name: str
    make: Callable[[Rng, float], Truth]
    paths: tuple[str, ...]
    axes: tuple[str, ...]
    alike: tuple[str, ...] = ()


def numbers(**values: float) -> Truth:
    return Truth(numbers=values)


def one_of(rng: Rng, *makes: Callable[[], Truth]) -> Truth:
    return makes[int(rng.integers(len(makes)))]()


def constant(rng: Rng, k: float) -> Truth:
    angle = rng.uniform(0, 2 * np.pi)
    return Truth(wind=np.array([[2.5 * k * np.cos(angle), 2.5 * k * np.sin(angle), 0.0]] * 2))


def gusts(rng: Rng, k: float) -> Truth:
    steps = 4700
    t = np.arange(steps) * 0.01
    wind = np.zeros((steps, 3))
    kind = int(rng.integers(3))
    for axis in range(2):
        if kind == 0:  # sines
            wind[:, axis] = (
                sum(np.sin(2 * np.pi * f * t + rng.uniform(0, 6.3)) for f in rng.uniform(0.05, 0.5, 3)) / 1.2
            )
        else:  # a random walk that is held back; or two of them in a row, as Dryden's
            tau = rng.uniform(1.5, 4.0)
            keep = np.exp(-0.01 / tau)
            draws = rng.normal(size=(kind, steps)) * np.sqrt(1 - keep**2)
            series = np.zeros(steps)
            for n in range(1, steps):
                series[n] = keep * series[n - 1] + draws[0, n]
            if kind == 2:
                smooth = np.exp(-0.01 / 0.4)
                for n in range(1, steps):
                    series[n] = smooth * series[n - 1] + (1 - smooth) * series[n]
            wind[:, axis] = series
    return Truth(wind=1.5 * k * wind)


def vector(rng: Rng, size: float) -> tuple[float, float, float]:
    v = rng.normal(size=3)
    v *= size / np.linalg.norm(v)
    return float(v[0]), float(v[1]), float(v[2])


def one_rotor(rng: Rng, k: float) -> Truth:
    made = [1.0] * 4
    made[int(rng.integers(4))] -= 0.08 * k
    return Truth(rotors=(made[0], made[1], made[2], made[3]))


ALL = ("circle", "lemniscate", "shuttle", "hops")
SCALES = ("thrust_scale", "mass", "rotor_thrust_difference")
EFFECTS = (
    Effect("rotor_drag", lambda r, k: one_of(
        r,
        lambda: numbers(drag_x=0, drag_y=0, drag_omega=8e-5 * k),
        lambda: numbers(drag_x=0.3 * k, drag_y=0.22 * k),
        lambda: numbers(drag_x=0, drag_y=0, drag_thrust=0.025 * k),
    ), ("lemniscate", "shuttle"), ("speed", "airspeed_direction")),
    Effect("body_drag_quadratic", lambda r, k: one_of(
        r,
        lambda: numbers(quad_all=0.02 * k),
        lambda: numbers(quad_x=0.02 * k, quad_y=0.03 * k, quad_z=0.05 * k),
    ), ("lemniscate", "shuttle"), ("speed", "airspeed_direction")),
    Effect("constant_wind", constant, ALL, ("airspeed_direction", "axis", "place", "speed")),
    Effect("gusting_wind", gusts, ALL, ("time",)),
    Effect("thrust_scale", lambda r, k: Truth(rotors=(1 + 0.04 * k,) * 4), ALL, ("thrust", "axis"), SCALES),
    Effect("thrust_lag", lambda r, k: one_of(
        r,
        lambda: Truth(numbers={"lag": 0.05 + 0.03 * k}, logs_command=True),
        lambda: Truth(numbers={"lag": 0.04 + 0.02 * k, "lag_order": 2}, logs_command=True),
    ), ("hops",), ("thrust", "acceleration", "angular_rate"), ("thrust_lag", "log_time_offset")),
    Effect("ground_effect", lambda r, k: one_of(
        r,
        lambda: numbers(ground_cb=2.0 * k),
        lambda: numbers(ground_exp=0.12 * k, ground_height=0.25),
    ), ("hops",), ("altitude",)),
    Effect("vertical_damping", lambda r, k: one_of(
        r,
        lambda: numbers(climb=0.4 * k),
        lambda: numbers(climb_thrust=0.03 * k),
    ), ("lemniscate", "shuttle", "hops"), ("speed", "airspeed_direction")),
    Effect("mass", lambda r, k: numbers(mass=MASS * (1 + 0.05 * k)), ALL, ("thrust", "axis"), SCALES),
    Effect("imu_bias", lambda r, k: Truth(bias=vector(r, 0.2 * k)), ALL, ("axis",)),
    Effect("imu_misalignment", lambda r, k: Truth(tilt=vector(r, 0.03 * k)), ("lemniscate", "shuttle", "hops"),
           ("axis", "thrust", "acceleration"), ("imu_bias",)),
    Effect("log_time_offset", lambda r, k: one_of(
        r,
        lambda: Truth(late={"imu": 0.03 * k}),
        lambda: Truth(late={"imu": -0.03 * k}),
    ), ("hops",), ("thrust", "acceleration", "angular_rate"), ("thrust_lag", "log_time_offset")),
    Effect("rotor_thrust_difference", one_rotor, ALL, ("thrust", "axis", "angular_rate"), SCALES),
)  # fmt: skip
WINDS = {"constant_wind", "gusting_wind"}
SIZES = {"weak": 0.4, "medium": 1.0, "strong": 2.5}


def the_vehicle(drag: bool) -> Vehicle:
    return Vehicle.model_validate(
        {
            "name": "withheld",
            "mass": MASS,
            "inertia": INERTIA.tolist(),
            "rotors": {
                "count": 4,
                "arm": ARM,
                "radius": RADIUS,
                "motor_time_constant": MOTOR_LAG,
                "torque_ratio": TORQUE,
                "max_thrust": 12.0,
            },
            "drag": {"law": "linear", "D": [BASE_DRAG, BASE_DRAG, 0.0]} if drag else {"law": "none"},
        }
    )


@dataclass(frozen=True)
class Case:
    """One log and what came of it."""

    effects: tuple[str, ...]
    strength: str
    found: Findings
    seconds: float

    @property
    def visible(self) -> bool:
        """Whether the log has the gap at all."""
        gap = self.found.diagnosis.gap
        return bool(np.sqrt(max(gap.before**2 - gap.floor**2, 0)) > VISIBLE * gap.floor)

    @property
    def first(self) -> tuple[str, ...]:
        """The first cause and those it ties with."""
        causes = self.found.diagnosis.causes
        return (causes[0].effect, *causes[0].indistinguishable_from) if causes else ()


def simulated(
    effects: tuple[Effect, ...], strength: str, seed: int, columns: str = ""
) -> tuple[FlightLog, Vehicle, str]:
    """A log of the simulator, the vehicle without the effects, and what was flown."""
    rng = np.random.default_rng(seed)
    paths = [name for name in ALL if all(name in effect.paths for effect in effects)]
    path = random_path(rng, paths[int(rng.integers(len(paths)))], low=True)
    truth = Truth()
    for effect in effects:
        truth = truth.plus(effect.make(rng, SIZES[strength]))
    noise = Noise(float(rng.uniform(0.05, 0.3)), attitude=float(rng.uniform(0.0, 0.004)))
    log = with_columns(flight(path, truth, noise, seed), columns)
    drag = all(effect.name != "rotor_drag" for effect in effects)
    return log, the_vehicle(drag), f"{path.kind} {path.speed:.0f} m/s"


def inverted(
    effects: tuple[Effect, ...], strength: str, seed: int, columns: str = ""
) -> tuple[FlightLog, Vehicle, str]:
    """The same from inverse dynamics, with other formulas (withheld_flight_inverse.py)."""
    rng = np.random.default_rng(seed)
    paths = [name for name in ALL if all(name in effect.paths for effect in effects)]
    kind = paths[int(rng.integers(len(paths)))]
    drag, force = inverse.BASES[int(rng.integers(len(inverse.BASES)))]
    if any(effect.name == "rotor_drag" for effect in effects):
        drag, force = {"law": "none"}, lambda v, _: 0.0 * v
    world = inverse.World()
    for effect in effects:
        if effect.name != "none":
            world = inverse.EFFECTS[effect.name](rng, SIZES[strength])
    log, words = inverse.fly(rng, kind, force, world)
    return with_columns(log, columns), inverse.vehicle(drag), f"{words}, formula {world.variant}"


SOURCES = {"simulator": simulated, "inverse": inverted}


def fly_case(
    effects: tuple[Effect, ...],
    strength: str,
    seed: int,
    without: tuple[str, ...] = (),
    columns: str = "",
    source: str = "simulator",
    config: FlightConfig = FlightConfig(),  # noqa: B008 - frozen
) -> Case:
    """Make a log and diagnose it."""
    log, vehicle, words = SOURCES[source](effects, strength, seed, columns)
    begin = time.process_time()  # as long on a machine that does other things too
    flown = investigate([log], vehicle, without, config=config)
    case = Case(tuple(effect.name for effect in effects), strength, flown, time.process_time() - begin)
    gap = flown.diagnosis.gap
    figures = f"{gap.before:.3f} {gap.after:.3f} {gap.floor:.3f} m/s², {case.seconds:.1f} s"
    said = f"{flown.diagnosis.verdict} {' = '.join(case.first)}, {figures}"
    print(f"{' + '.join(case.effects)} {strength} {seed} on {words}: {said}", file=sys.stderr, flush=True)
    return case


def share(good: int, count: int) -> str:
    """A share with Wilson's 95 % interval."""
    low, high = wilson(good, count)
    return f"{good / count:.0%} ({low:.0%} to {high:.0%}), {good} of {count}" if count else "-"


def single(console: Console, logs: int, seed: int, source: str, config: FlightConfig) -> None:
    cases = [
        fly_case(
            (effect,),
            strength,
            seed + 1000 * number + 100 * STRENGTHS.index(strength) + index,
            source=source,
            config=config,
        )
        for number, effect in enumerate(EFFECTS)
        for strength in STRENGTHS
        for index in range(logs)
    ]
    table = Table(
        "effect", *STRENGTHS, "closed, median", "not visible", title="One effect withheld from the vehicle: named"
    )
    for effect in EFFECTS:
        mine = [case for case in cases if case.effects == (effect.name,)]
        row = []
        for strength in STRENGTHS:
            seen = [case for case in mine if case.strength == strength and case.visible]
            row.append(f"{sum(map(named, seen))} of {len(seen)}")
        closed = [case.found.diagnosis.gap.closed_fraction for case in mine if case.visible and named(case)]
        hidden = sum(not case.visible for case in mine)
        table.add_row(effect.name, *row, f"{np.median(closed):.2f}" if closed else "-", str(hidden))
    console.print(table)
    seen = [case for case in cases if case.visible and case.strength != "weak"]
    console.print(
        f"named first or in a tie of two, medium and strong: {share(sum(map(named, seen)), len(seen))}; aim 95 %"
    )
    closed = [case.found.diagnosis.gap.closed_fraction for case in seen]
    console.print(f"closed fraction on held-out time, median: {np.median(closed):.3f}; aim 0.9")
    seconds = [case.seconds for case in cases]
    console.print(
        f"a 45 s log: median {np.median(seconds):.1f} s of processor time, most {np.max(seconds):.1f} s; aim 5 s"
    )
    right = [case for case in cases if case.visible and named(case)]
    more = [case for case in right if further(case)]
    console.print(
        f"no wrong further cause where the first is right: {share(len(right) - len(more), len(right))}; aim 95 %"
    )
    for case in more:
        console.print(f"    {case.effects[0]} {case.strength}: and {', '.join(further(case))}")
    confusion = Counter((case.effects[0], case.first[0] if case.first else "-") for case in seen if not named(case))
    for (truth, found), count in confusion.most_common():
        console.print(f"  {truth} misattributed to {found}: {count}")
    for case in seen:
        if not named(case):
            console.print(f"    {case.effects[0]} {case.strength}: {case.found.diagnosis.verdict} {case.first}")


def named(case: Case) -> bool:
    return case.effects[0] in case.first and len(case.first) <= 2


def further(case: Case) -> list[str]:
    """Causes that are none of the truth's."""
    return [cause.effect for cause in case.found.diagnosis.causes if not is_of(case.effects, cause)]


def is_of(effects: tuple[str, ...], cause: Cause) -> bool:
    """Whether a cause is one of the effects, or indistinguishable from one; winds are one family."""
    names = {cause.effect, *cause.indistinguishable_from}
    if names & WINDS and WINDS & set(effects):
        return True
    return bool(names & set(effects))


def unknown(console: Console, logs: int, seed: int, source: str, config: FlightConfig) -> None:
    cases = []
    for number, effect in enumerate(EFFECTS):
        for strength in STRENGTHS[1:]:
            for index in range(logs):
                place = seed + 50_000 + 1000 * number + 100 * STRENGTHS.index(strength) + index
                cases.append(
                    (
                        effect,
                        fly_case(
                            (effect,), strength, place, (effect.name, *effect.alike), source=source, config=config
                        ),
                    )
                )
    table = Table(
        "effect", "reported, right axis", "reported", "another name fits it", title="Withheld from the bank too"
    )
    good, total = 0, 0
    misses = []
    for effect in EFFECTS:
        mine = [case for one, case in cases if one is effect and case.visible]
        right = [told_unknown(case, effect) for case in mine]
        good, total = good + sum(right), total + len(mine)
        reported = sum(case.found.diagnosis.unexplained is not None for case in mine)
        fits = sum(case.found.diagnosis.verdict == "explained" for case in mine)
        table.add_row(effect.name, f"{sum(right)} of {len(mine)}", str(reported), str(fits))
        misses += [(effect.name, case) for case, ok in zip(mine, right, strict=True) if not ok]
    console.print(table)
    console.print(f"reported as unexplained, right axis in the first two: {share(good, total)}; aim 90 %")
    seen = [case for _, case in cases if case.visible]
    clean = [case for case in seen if not case.found.diagnosis.causes]
    console.print(f"no wrong name at all: {share(len(clean), len(seen))}; aim 85 %")
    for case in seen:
        if case.found.diagnosis.causes:
            names = [cause.effect for cause in case.found.diagnosis.causes]
            console.print(f"    {case.effects[0]} {case.strength}: {names}")
    for name, case in misses:
        diagnosis = case.found.diagnosis
        axes = [cut.axis for cut in diagnosis.unexplained.where[:2]] if diagnosis.unexplained else []
        console.print(
            f"    {name} {case.strength}: {diagnosis.verdict} {case.first} {axes} {diagnosis.gap.closed_fraction}"
        )


def told_unknown(case: Case, effect: Effect) -> bool:
    unexplained = case.found.diagnosis.unexplained
    return unexplained is not None and any(cut.axis in effect.axes for cut in unexplained.where[:2])


def none(console: Console, logs: int, seed: int, source: str, config: FlightConfig) -> None:
    effect = Effect("none", lambda rng, k: Truth(), ALL, ())
    cases = [
        fly_case(
            (effect,),
            "medium",
            seed + 90_000 + index,
            columns=("", "total", "no_imu")[index % 3],
            source=source,
            config=config,
        )
        for index in range(10 * logs)
    ]
    false = [case for case in cases if case.found.diagnosis.verdict != "no_gap"]
    console.print(f"no effect at all, a gap claimed: {share(len(false), len(cases))}; aim under 2 %")
    for case in false:
        where = [cut.axis for cut in case.found.diagnosis.where]
        console.print(f"    {case.found.diagnosis.verdict} {case.first} {where} {case.found.diagnosis.gap}")


def real(console: Console, logs: int, seed: int, source: str, config: FlightConfig) -> None:
    from depthsim.flight.nanobench import read_any
    from depthsim.gap.flight.fit.validate import lateral_errors

    files = sorted(FLIGHTS.glob("*.csv"))
    if len(files) < 8:
        console.print(f"NanoBench: left out, the flights are not in {FLIGHTS.parent.name}/{FLIGHTS.name}")
        return
    flights = [read_any(file) for file in files]
    keys = load_vehicle("crazyflie").model_dump()
    keys |= {"mass": 0.035, "drag": {"law": "none"}}
    vehicle = Vehicle.model_validate(keys)
    begin = time.perf_counter()
    table = Table(
        "held out", "before", "offset known", "from 5 s", "causes", title="NanoBench, lateral, 4 Hz, RMS [m/s²]"
    )
    rows = []
    for out in ((0, 4), (1, 5), (2, 6), (3, 7)):
        train = [log for index, log in enumerate(flights) if index not in out]
        flown = investigate(train, vehicle, config=config)
        before, removed, start = lateral_errors(flown, [flights[index] for index in out])
        rows.append((before, removed, start))
        names = ", ".join(cause.effect for cause in flown.diagnosis.causes)
        held_out = " and ".join(files[index].stem for index in out)
        table.add_row(held_out, f"{before:.3f}", f"{removed:.4f}", f"{start:.4f}", names)
    console.print(table)
    before, removed, start = np.mean(rows, axis=0)
    console.print(
        f"mean: {before:.3f} before, {removed:.4f} with the flight's own accelerometer bias, {start:.4f} with the bias "
        f"of its first 5 s; aim 0.05; {time.perf_counter() - begin:.0f} s"
    )


def parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--logs", type=int, default=4, help="for each effect and strength; ten times as many without one"
    )
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--tier", default="single,unknown,none,pairs,wind,intervals,real")
    parser.add_argument(
        "--source", default="simulator", choices=SOURCES, help="of the flights, but for the tiers pairs and real"
    )
    parser.add_argument("--set", dest="vary", action="append", default=[], metavar="SECTION.NAME=VALUE", help=HELP)
    return parser


def main() -> None:
    from benchmarks.withheld_flight_tiers import intervals, pairs, winds

    tiers = {
        "single": single, "unknown": unknown, "none": none, "pairs": pairs, "wind": winds, "intervals": intervals,
        "real": real,
    }  # fmt: skip
    given = parser().parse_args()
    config = FlightConfig.varied(given.vary)
    console = Console(width=None if sys.stdout.isatty() else 140)
    for name in given.tier.split(","):
        tiers[name](console, given.logs, given.seed, given.source, config)


if __name__ == "__main__":
    main()
