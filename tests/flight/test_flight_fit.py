"""Fits find what a simulator that shares no code with them put in, and say how sure they are."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.flight.fit import craft_of, fit_drag, fit_thrust_map
from depthsim.flight.fit.motion import low_pass, motion_of
from depthsim.flight.fit.report import fitted_vehicle, write_report
from depthsim.flight.fit.sums import Sums, interval95, solve
from depthsim.flight.fit.words import notes
from depthsim.flight.log import FlightLog, write_flight
from depthsim.flight.nanobench import read_any
from depthsim.flight.vehicle import Vehicle, load_vehicle

NANOBENCH = Path(__file__).parents[2] / "../shared/data/flight_nanobench"
G, MASS, ARM = 9.80665, 1.2, 0.2
Force = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Body velocity (N, 3), rates (N, 3) and rotor thrusts (N, 4) to a body force (N, 3)."""
PLACES = ARM * np.sqrt(0.5) * np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]])


def craft() -> Vehicle:
    keys = {
        "name": "test",
        "mass": MASS,
        "inertia": [0.02, 0.02, 0.03],
        "rotors": {"count": 4, "arm": ARM, "radius": 0.12, "motor_time_constant": 0.02},
        "drag": {"law": "none"},
    }
    return Vehicle.model_validate(keys)


def linear(d: tuple[float, float, float]) -> Force:
    return lambda v, w, thrust: -np.array(d) * v


def root(c: float) -> Force:
    def force(v: np.ndarray, w: np.ndarray, thrust: np.ndarray) -> np.ndarray:
        total = np.zeros_like(v)
        for i in range(4):
            total -= c * np.sqrt(np.maximum(thrust[:, i], 0))[:, None] * (v + np.cross(w, PLACES[i]))
        return total * [1, 1, 0]

    return force


def quadratic(c: tuple[float, float, float]) -> Force:
    return lambda v, w, thrust: -np.array(c) * np.abs(v) * v


def fly(
    force: Force, seed: int, *, speed: float = 6.0, seconds: float = 25.0, climb: float = 1.0, noise: float = 0.0,
    rate: float = 100.0, yaw_rate: float = 0.0, offset: tuple[float, float] = (0.0, 0.0),
) -> FlightLog:  # fmt: skip
    """A flight along sines whose attitude and thrust obey Newton's law at every sample: m (a + g e3) = R (T e3 + F)."""
    draw = np.random.default_rng(seed)
    t = np.arange(int(seconds * rate)) / rate
    frequency = draw.uniform(0.7, 1.3, (3, 2)) * [[0.9, 1.7]]
    phase = draw.uniform(0, 2 * np.pi, (3, 2))
    size = np.array([[speed / 2, speed / 4], [speed / 2, speed / 4], [climb / 2, climb / 4]])
    angle = t[:, None, None] * frequency + phase
    position = (size / frequency * np.sin(angle)).sum(axis=2) + np.array([0, 0, 10])
    velocity = (size * np.cos(angle)).sum(axis=2)
    acceleration = (-size * frequency * np.sin(angle)).sum(axis=2)
    yaw = yaw_rate * t
    need = MASS * (acceleration + np.array([0, 0, G]))
    air, w, thrusts = np.zeros_like(need), np.zeros_like(need), np.full((len(t), 4), MASS * G / 4)
    share = 0.25 * (1 + 0.2 * draw.normal(size=(4, 2)) @ np.array([np.sin(3 * t), np.cos(2 * t)])).T
    share /= share.sum(axis=1, keepdims=True)
    for _ in range(40):
        along = need - air
        z = along / np.linalg.norm(along, axis=1, keepdims=True)
        y = np.cross(z, np.stack([np.cos(yaw), np.sin(yaw), 0 * yaw], axis=1))
        y /= np.linalg.norm(y, axis=1, keepdims=True)
        turn = np.stack([np.cross(y, z), y, z], axis=2)
        body = np.einsum("nji,nj->ni", turn, velocity)
        step = Rotation.from_matrix(turn[:-1].transpose(0, 2, 1) @ turn[1:]).as_rotvec() * rate
        w = np.vstack([step[:1], (step[1:] + step[:-1]) / 2, step[-1:]])
        f = force(body, w, thrusts)
        thrust = np.einsum("nj,nj->n", need, z) - f[:, 2]
        thrusts = thrust[:, None] * share
        # Only what lies across the thrust turns the vehicle; what lies along it is the thrust's to bear.
        air = np.einsum("nij,nj->ni", turn, f * [1, 1, 0])
    measured = np.einsum("nji,nj->ni", turn, need) / MASS
    measured += noise * draw.normal(size=measured.shape) + [*offset, 0]
    quaternion = Rotation.from_matrix(turn).as_quat()
    return FlightLog(t, velocity, quaternion, w, position, None, thrusts, measured, source=f"flight{seed}.csv")


LAWS = [
    ("linear", linear((0.3, 0.4, 0.2)), [0.3, 0.4, 0.2]),
    ("rotor_sqrt", root(0.05), [0.05]),
    ("airsim_quadratic", quadratic((0.02, 0.03, 0.04)), np.array([0.02, 0.03, 0.04]) / (0.5 * 1.225 * 1.3 / 4)),
]


@pytest.mark.parametrize(("name", "force", "truth"), LAWS)
def test_the_law_and_its_coefficients_are_found(name: str, force: Force, truth: list[float]) -> None:
    offsets = [(0.1, -0.2), (0.3, 0.1), (-0.2, 0.0)]
    logs = [fly(force, seed, climb=4, noise=0.05, offset=offset, yaw_rate=0.3) for seed, offset in enumerate(offsets)]
    fit = fit_drag(logs, craft())
    found = fit.law(name)
    np.testing.assert_allclose(found.values, truth, rtol=0.03)
    assert fit.best == name
    assert found.judgement.removed.worst < 0.05
    assert found.judgement.removed.mean < 0.3 * fit.law("none").judgement.removed.mean
    for part, offset in zip(fit.per_flight, offsets, strict=True):
        np.testing.assert_allclose(part.offset, offset, atol=0.03)
        assert part.scale == pytest.approx(1, abs=0.01)
    assert found.judgement.start.mean < 0.1 < found.judgement.kept.mean


def test_without_noise_the_coefficients_are_exact() -> None:
    fit = fit_drag([fly(linear((0.3, 0.4, 0.2)), seed, climb=3) for seed in (4, 5)], craft())
    np.testing.assert_allclose(fit.law("linear").values, [0.3, 0.4, 0.2], rtol=1e-3)
    found = fit_drag([fly(root(0.05), seed, climb=3) for seed in (4, 5)], craft()).law("rotor_sqrt")
    np.testing.assert_allclose(found.values, [0.05], rtol=1e-3)


def test_velocities_stand_in_for_a_missing_accelerometer() -> None:
    logs = [replace(fly(linear((0.3, 0.4, 0.2)), seed, climb=3), specific_force=None) for seed in (1, 2)]
    fit = fit_drag(logs, craft())
    assert not fit.measured
    np.testing.assert_allclose(fit.law("linear").values, [0.3, 0.4, 0.2], rtol=0.02)


def test_the_exponent_of_thrust_tells_the_laws_apart_only_where_thrust_varies() -> None:
    lively = fit_drag([fly(root(0.05), seed, climb=6, noise=0.05) for seed in (1, 2, 3)], craft())
    assert lively.exponent.low < 0.5 < lively.exponent.high and lively.exponent.low > 0
    assert lively.exponent.variation > 0.1 and "linear" not in (lively.best, *lively.ties)
    assert any("agrees with rotor drag" in note for note in notes(lively, []))
    calm = [fly(root(0.05), seed, speed=0.8, climb=0.05, noise=0.3) for seed in (1, 2, 3)]
    fit = fit_drag(calm, craft())
    assert {"linear", "rotor_linear", "rotor_sqrt"} <= {fit.best, *fit.ties}
    assert fit.best == "linear" or "linear" in fit.ties
    reported = " ".join(notes(fit, calm))
    assert "a tie: " in reported and "cannot distinguish linear drag from rotor drag, nor k from b" in reported


def test_no_drag_is_reported() -> None:
    logs = [fly(linear((0, 0, 0)), seed, noise=0.2) for seed in range(3)]
    fit = fit_drag(logs, craft())
    assert fit.best == "none"
    assert any("no drag is seen" in note for note in notes(fit, logs))
    assert fitted_vehicle(fit, "given").drag.law == "none"


def test_what_a_log_lacks_is_reported() -> None:
    logs = [replace(fly(linear((0.3, 0.4, 0.2)), seed, noise=0.05), rotor_thrusts=None) for seed in range(3)]
    fit = fit_drag(logs, craft())
    assert fit.law("linear").known == (True, True, False) and fit.law("linear").values[2] == 0
    assert fit.thrust_from == "the accelerometer" and fit.per_flight[0].scale is None
    assert any("Dz is not known (no thrust in the log)" in note for note in notes(fit, logs))
    alone = fit_drag(logs[:1], craft())
    assert alone.law("linear").judgement.splits == 6  # pairs of quarters
    assert any("one flight only" in note for note in notes(alone, logs[:1]))


def test_flights_that_each_move_along_one_axis() -> None:
    flights = [fly(linear((0.3, 0.4, 0.2)), seed, noise=0.02) for seed in range(4)]
    flights = [
        replace(log, velocity=log.velocity * axis) for log, axis in zip(flights, np.eye(3)[[0, 0, 1, 1]], strict=True)
    ]
    fit = fit_drag(flights, craft())  # some splits then know nothing of Dx or of Dy
    assert np.isfinite(fit.law("linear").values).all()


def test_a_hover_knows_no_drag() -> None:
    t = np.arange(1500) / 100
    still, ones = np.zeros((1500, 3)), np.ones((1500, 1))
    force = np.array([0, 0, G]) + 0.01 * np.random.default_rng(0).normal(size=(1500, 3))
    log = FlightLog(t, still, ones * [0, 0, 0, 1], still, still, np.full(1500, MASS * G), None, force)
    fit = fit_drag([log], craft())
    assert fit.best == "none" and not any(fit.law("linear").known) and fit.exponent is None
    assert any("Dx is not known (no motion along it)" in note for note in notes(fit, [log]))


def test_tests_are_not_fitted() -> None:
    logs = [fly(linear((0.3, 0.4, 0.2)), seed, noise=0.05) for seed in range(2)]
    other = fly(linear((0.6, 0.8, 0.2)), 7, noise=0.05)
    fit = fit_drag(logs, craft(), [other])
    np.testing.assert_allclose(fit.law("linear").values[:2], [0.3, 0.4], rtol=0.03)
    assert fit.law("linear").judgement.splits == 1 and fit.law("linear").judgement.removed.mean > 0.5
    assert [part.tested for part in fit.per_flight] == [False, False, True]


def correlated(draw: np.random.Generator, shape: tuple[int, ...], seconds: float, rate: float) -> np.ndarray:
    """Noise of unit variance whose correlation falls by e in so many seconds."""
    a = np.exp(-1 / (seconds * rate))
    out = np.empty(shape)
    out[0] = draw.normal(size=shape[1:])
    for i in range(1, shape[0]):
        out[i] = a * out[i - 1] + np.sqrt(1 - a * a) * draw.normal(size=shape[1:])
    return out


@pytest.mark.parametrize(("flights", "spread"), [(2, 0.0), (6, 0.0), (8, 0.05)])
def test_intervals_hold_the_truth_as_often_as_they_say(flights: int, spread: float) -> None:
    """60 repeats of two coefficients with correlated noise; ``spread``: of the drag from flight to flight."""
    rate, repeats, held, widths, found = 50.0, 60, [], [], []
    draw = np.random.default_rng(5)
    truth = np.array([0.3, 0.4])
    states = [
        low_pass(fly(linear((0, 0, 0)), seed, rate=rate, seconds=20).velocity[:, :2], rate, 4.0)
        for seed in range(flights)
    ]
    for _ in range(repeats):
        sums = []
        for v in states:
            x = np.zeros((len(v), 2, 2))
            x[:, 0, 0], x[:, 1, 1] = -v[:, 0], -v[:, 1]
            y = x @ (truth * (1 + spread * draw.normal())) + draw.normal(size=2)
            y = y + 0.3 * correlated(draw, y.shape, 0.4, rate)
            sums.append(Sums.of_blocks(y, x, np.ones_like(y), rate))
        low, high = interval95(sums)
        held.append((low <= truth) & (truth <= high))
        widths.append((high - low) / 2)
        found.append(solve(Sums.stacked([flight.total() for flight in sums])))
    assert np.mean(held) >= 0.89  # 95 % within three standard errors of 120 draws; wider is allowed
    assert (np.mean(widths, axis=0) < 4.5 * np.std(found, axis=0)).all()  # but not just by being wide


def with_motors(log: FlightLog, scale: float, volts: float) -> FlightLog:
    """The log without thrusts, but with the commands and the battery that made them."""
    battery = np.linspace(volts, volts - 0.2, len(log))
    # Each rotor: T / m = scale (2 u + 1.5 u²), u = pwm / 65535 · (battery / 3.5)^0.5, solved for pwm.
    assert log.rotor_thrusts is not None
    u = (-2 + np.sqrt(4 + 6 * log.rotor_thrusts / MASS / scale)) / 3
    pwm = u * 65535 / np.sqrt(battery / 3.5)[:, None]
    extras = {f"pwm{i + 1}": pwm[:, i] for i in range(4)}
    return replace(log, rotor_thrusts=None, extras={**extras, "battery": battery})


def test_the_thrust_map_is_found() -> None:
    plan = enumerate([(1.01, 3.9), (0.99, 3.6), (1.0, 3.3), (1.0, 3.75)])
    logs = [with_motors(fly(root(0.05), seed, climb=4, noise=0.05), *given) for seed, given in plan]
    found = fit_thrust_map([motion_of(log) for log in logs])
    assert found.input.power == 0.5
    reference = (found.input.reference / 3.5) ** np.array([0.5, 1.0])
    np.testing.assert_allclose(found.coefficients, [2, 1.5] * reference, rtol=0.05)
    np.testing.assert_allclose(found.scales, [1.01, 0.99, 1, 1], atol=3e-3)
    assert found.scaled_error < 0.03 < found.error
    fit = fit_drag(logs, craft())
    np.testing.assert_allclose(fit.law("rotor_sqrt").values, [0.05], rtol=0.03)
    kind, full, curve = found.curve(MASS)
    hover = sum(c * found.hover**power for power, c in enumerate(curve)) * 4
    assert (kind, full) == ("pwm", 65535) and hover == pytest.approx(MASS * G, rel=0.1)


def test_rotor_speeds_make_a_map_too() -> None:
    log = fly(root(0.05), 3, climb=4)
    omega = np.sqrt(log.rotor_thrusts / 1e-5)
    log = replace(log, rotor_thrusts=None, extras={f"omega{i + 1}": omega[:, i] for i in range(4)})
    found = fit_thrust_map([motion_of(log)])
    np.testing.assert_allclose(found.coefficients * MASS, [1e-5], rtol=1e-3)
    assert fit_thrust_map([motion_of(replace(log, extras={}))]) is None


def test_the_mass_is_given_weighed_assumed_or_asked_for() -> None:
    log = fly(linear((0.3, 0.4, 0.2)), 1)
    assert craft_of([log], None, 2.5).vehicle.mass == 2.5
    assert craft_of([log]).vehicle.mass == pytest.approx(MASS, rel=0.02)
    bare = replace(log, rotor_thrusts=None)
    assert craft_of([bare], "crazyflie").vehicle.mass == load_vehicle("crazyflie").mass
    nano = craft_of([replace(bare, kind="NanoBench")])
    assert nano.vehicle.mass == 0.035 and "assumed" in nano.mass_from and "crazyflie" in nano.vehicle.name
    assert craft_of([log], "crazyflie", 5.0).vehicle.mass == 5.0  # its motors could not lift that
    with pytest.raises(InputError, match="does not give the mass"):
        craft_of([bare])
    with pytest.raises(InputError, match="`mass`"):
        craft_of([log], None, -1.0)


BROKEN = {
    "short": (lambda log: log.select(slice(0, 300)), "s in the air"),
    "gap": (lambda log: log.select(np.r_[0:1000, 1100:2500]), "has a gap of 1.01 s after t 9.99"),
    "slow": (lambda log: log.select(slice(0, None, 10)), "has 10 samples a second"),
    "in g": (lambda log: replace(log, specific_force=log.specific_force / G), "the specific force is 1"),
    "no thrust": (lambda log: replace(log, rotor_thrusts=0 * log.rotor_thrusts), "thrust: is 0 or below"),
    "no pwm": (lambda log: replace(log, rotor_thrusts=None, extras={"pwm1": 0 * log.t}), "pwm1: is 0 throughout"),
    "six rotors": (lambda log: replace(log, rotor_thrusts=np.tile(log.rotor_thrusts[:, :1], 6)), "has 4 rotors"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_logs_that_do_not_do(name: str) -> None:
    spoil, problem = BROKEN[name]
    with pytest.raises(InputError, match=problem) as error:
        fit_drag([spoil(fly(linear((0.3, 0.4, 0.2)), 1))], craft())
    assert "\n" not in str(error.value)


def test_the_ground_is_cut_off() -> None:
    log = fly(linear((0.3, 0.4, 0.2)), 1, seconds=20)
    still = 500
    stand = log.select(np.r_[np.zeros(still, int), np.arange(len(log))])
    t = np.arange(len(stand)) / 100
    rest = t < still / 100
    stand = replace(stand, t=t, velocity=np.where(rest[:, None], 0.0, stand.velocity))
    motion = motion_of(stand)
    assert still + 100 <= motion.airborne.start <= still + 130
    assert motion_of(replace(stand, position=None)).airborne.start == pytest.approx(motion.airborne.start, abs=5)


def test_an_uneven_log_gives_the_same() -> None:
    log = fly(linear((0.3, 0.4, 0.2)), 1, seconds=20, rate=200)
    keep = np.sort(np.random.default_rng(0).choice(len(log), size=len(log) * 3 // 4, replace=False))
    found = fit_drag([log.select(keep)], craft()).law("linear").values
    np.testing.assert_allclose(found, [0.3, 0.4, 0.2], rtol=0.03)


def test_the_command_writes_a_vehicle_that_loads(tmp_path: Path) -> None:
    paths = [tmp_path / f"f{seed}.csv" for seed in range(2)]
    for seed, path in enumerate(paths):
        write_flight(fly(linear((0.3, 0.4, 0.2)), seed, climb=3, noise=0.05, seconds=15), path)
    out = tmp_path / "fit"
    result = CliRunner().invoke(app, ["fit-drag", *map(str, paths), "--out", str(out)], env={"COLUMNS": "160"})
    assert result.exit_code == 0, result.output
    assert "airsim_quadratic" in result.output and "from thrust over specific force in the log" in result.output
    vehicle = load_vehicle(out / "vehicle.yaml")
    assert vehicle.drag.law == "linear" and vehicle.mass == pytest.approx(MASS, rel=0.02)
    np.testing.assert_allclose(vehicle.drag.D, [0.3, 0.4, 0.2], rtol=0.05)
    assert (out / "drag_fit.png").read_bytes().startswith(b"\x89PNG")
    assert len((out / "drag_fit.csv").read_text().splitlines()) == 1 + 1 + 3 + 4 + 3
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    fixed = ["--law", "rotor_linear", "--test", str(paths[1]), "--mass", "1.2"]
    assert CliRunner().invoke(app, ["fit-drag", str(paths[0]), *fixed, "--out", str(out)]).exit_code == 0
    assert load_vehicle(out / "vehicle.yaml").drag.law == "rotor_linear"
    assert CliRunner().invoke(app, ["fit-drag", *map(str, paths), "--out", str(out)]).exit_code == 0
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (["--law", "cubic"], "is no drag law"),
        (["--cutoff", "0"], "give a frequency"),
        (["--vehicle", "zeppelin"], "is no vehicle"),
        (["--test", "LOG"], "is given twice"),
        (["--test", "nothing.csv"], "no such file"),
        (["--mass", "nan"], "--mass"),
    ],
)
def test_the_command_refuses(tmp_path: Path, options: list[str], problem: str) -> None:
    log = tmp_path / "f.csv"
    write_flight(fly(linear((0.3, 0.4, 0.2)), 0, seconds=8), log)
    words = [str(log) if option == "LOG" else option for option in options]
    result = CliRunner().invoke(app, ["fit-drag", str(log), *words, "--out", str(tmp_path / "out")])
    assert isinstance(result.exception, InputError) and problem in str(result.exception)
    assert not (tmp_path / "out").exists()


def test_negative_drag_is_reported_and_written_as_none(tmp_path: Path) -> None:
    logs = [fly(linear((-0.2, 0.4, 0.2)), seed, noise=0.02) for seed in range(2)]
    fit = fit_drag(logs, craft())
    assert any("Dx is below 0" in note for note in notes(fit, logs))
    write_report(tmp_path, fit, fitted_vehicle(fit, "given", "linear"))
    assert load_vehicle(tmp_path / "vehicle.yaml").drag.D[0] == 0


def test_nanobench_on_unseen_flights() -> None:
    files = sorted(NANOBENCH.glob("*.csv"))
    if len(files) < 8:
        pytest.skip("the real flights are not there (flight_nanobench in ../shared/data)")
    logs = [read_any(file) for file in files]
    fit = fit_drag(logs, craft_of(logs).vehicle)
    found = fit.law("linear")
    assert found.judgement.splits == 28
    assert found.judgement.removed.mean < 0.04 and found.judgement.removed.worst < 0.047
    assert found.judgement.start.mean < 0.042
    assert 0.2 < fit.law("none").judgement.removed.mean < 0.26
    np.testing.assert_allclose(found.values[:2] / 0.035, 0.395, atol=0.02)
    assert {"linear", "rotor_linear", "rotor_sqrt"} <= {fit.best, *fit.ties}
    assert "airsim_quadratic" not in (fit.best, *fit.ties)
    assert fit.exponent.variation < 0.03 and fit.exponent.low < 0 and fit.exponent.high > 0.5
    assert np.std([part.scale for part in fit.per_flight]) < 0.015
