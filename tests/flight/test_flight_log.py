"""flight.csv and NanoBench's files: what is read is what was written, and what is broken is reported in one line."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from depthsim.errors import InputError
from depthsim.flight.log import FlightLog, rates_from_attitude, read_flight, write_flight
from depthsim.flight.nanobench import read_any, read_nanobench

NANOBENCH = Path(__file__).parents[2] / "../shared/data/flight_nanobench"


def a_log(n: int = 40, seed: int = 0) -> FlightLog:
    draw = np.random.default_rng(seed)
    return FlightLog(
        t=np.cumsum(draw.uniform(0.005, 0.015, n)),
        velocity=draw.normal(size=(n, 3)),
        quaternion=Rotation.random(n, random_state=seed).as_quat(),
        rates=draw.normal(size=(n, 3)),
        position=draw.normal(size=(n, 3)),
        thrust=draw.uniform(5, 15, n),
        rotor_thrusts=draw.uniform(1, 4, (n, 4)),
        specific_force=draw.normal(size=(n, 3)),
        extras={"pwm1": draw.uniform(0, 65535, n), "pwm2": draw.uniform(0, 65535, n), "battery": np.full(n, 3.7)},
    )


def same(one: FlightLog, other: FlightLog) -> bool:
    names = ("t", "velocity", "rates", "position", "thrust", "rotor_thrusts", "specific_force")
    pairs = [(getattr(one, name), getattr(other, name)) for name in names]
    pairs += [(one.extras[name], other.extras[name]) for name in one.extras]
    return all((a is None and b is None) or np.array_equal(a, b) for a, b in pairs)


@settings(max_examples=25)
@given(seed=st.integers(0, 2**31 - 1), absent=st.sets(st.sampled_from(["position", "thrust", "rotor_thrusts"])))
def test_what_is_written_is_read(tmp_path_factory: pytest.TempPathFactory, seed: int, absent: set[str]) -> None:
    path = tmp_path_factory.mktemp("log") / "flight.csv"
    log = replace(a_log(seed=seed), **dict.fromkeys(absent))
    write_flight(log, path)
    read = read_flight(path)
    assert same(read, log)
    assert np.abs(read.quaternion - log.quaternion).max() < 1e-15
    text = path.read_bytes()
    write_flight(read, path)
    assert path.read_bytes() == text


def test_the_sum_of_the_rotors_is_the_thrust_where_there_is_no_other() -> None:
    log = a_log()
    assert np.array_equal(log.total_thrust, log.thrust)
    np.testing.assert_allclose(replace(log, thrust=None).total_thrust, log.rotor_thrusts.sum(axis=1))
    assert replace(log, thrust=None, rotor_thrusts=None).total_thrust is None
    assert log.rotor_columns("pwm").shape == (40, 2)
    assert log.rotor_columns("omega") is None


def test_a_wrong_shape_is_an_error_of_the_program() -> None:
    with pytest.raises(ValueError, match="velocity"):
        replace(a_log(), velocity=np.zeros((3, 3)))


def turning(n: int = 400) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Stamps, attitude and exact body rates of a constant turn about a fixed axis of the body."""
    t, rate = np.arange(n) / 100, np.array([0.4, -0.7, 1.1])
    return t, Rotation.from_rotvec(t[:, None] * rate).as_quat(), np.tile(rate, (n, 1))


def test_rates_follow_from_the_attitude() -> None:
    t, quaternion, rates = turning()
    quaternion[150:] *= -1  # the same attitude
    assert np.abs(rates_from_attitude(t, quaternion) - rates)[1:-1].max() < 1e-4


def test_what_is_not_in_the_file_is_derived_and_said(tmp_path: Path) -> None:
    t, quaternion, rates = turning()
    position = np.stack([t**2, 2 * t, np.ones_like(t)], axis=1)
    columns = np.column_stack([t, position, quaternion, np.zeros(len(t))])
    np.savetxt(tmp_path / "f.csv", columns, delimiter=",", header="t,px,py,pz,qx,qy,qz,qw,mode", comments="")
    log = read_flight(tmp_path / "f.csv")
    assert log.left_out == ("mode",)
    assert log.derived == ("velocities from positions", "angular rates from attitude")
    assert log.specific_force is None and log.total_thrust is None
    assert np.abs(log.velocity[1:-1] - np.column_stack([2 * t, 2 + 0 * t, 0 * t])[1:-1]).max() < 1e-9
    assert np.abs(log.rates - rates)[1:-1].max() < 1e-4


def test_quaternions_are_normalised_and_comments_and_text_columns_do_not_matter(tmp_path: Path) -> None:
    rows = "\n# a comment\n".join(f"{i * 0.01},hover,1,0,0,0,0,0,{1.004},9" for i in range(5))
    (tmp_path / "f.csv").write_text("\ufefft,mode,vx,vy,vz,qx,qy,qz,qw,thrust\n" + rows + "\n\n")
    log = read_flight(tmp_path / "f.csv")
    assert np.array_equal(log.quaternion, np.tile([0, 0, 0, 1.0], (5, 1)))
    assert log.left_out == ("mode",)


HEAD = "t,vx,vy,vz,qx,qy,qz,qw"
ROW = "1,0,0,0,0,0,1"
GOOD = "\n".join(f"{i / 100},{ROW}" for i in range(6))
BROKEN = {
    "empty": ("", "is empty"),
    "header alone": (HEAD, "holds 0 rows"),
    "two rows": (f"{HEAD}\n0,{ROW}\n1,{ROW}", "holds 2 rows"),
    "no header": (GOOD, "holds numbers, not column names"),
    "semicolons": (f"{HEAD};thrust".replace(",", ";") + f"\n{GOOD}", "not separated by commas"),
    "no t": (HEAD.replace("t,", "time,", 1) + f"\n{GOOD}", "has no column t"),
    "no attitude": ("t,vx,vy,vz\n0,1,2,3\n1,1,2,3\n2,1,2,3", "has no attitude"),
    "no motion": ("t,qx,qy,qz,qw\n0,0,0,0,1\n1,0,0,0,1\n2,0,0,0,1", "neither velocities nor positions"),
    "half a vector": (HEAD.replace("vy", "v_y") + f"\n{GOOD}", "has vx vz without vy"),
    "a name twice": (HEAD.replace("vy", "vx") + f"\n{GOOD}", "'vx' comes twice"),
    "not a number": (f"{HEAD}\n{GOOD}\n1,{ROW}".replace("0.02,1", "0.02,fast"), "line 4, vx: is 'fast'"),
    "empty cell": (f"{HEAD}\n{GOOD}".replace("0.02,1", "0.02,"), "line 4, vx: is empty"),
    "underscore": (f"{HEAD}\n{GOOD}".replace("0.02,1", "0.02,1_0"), "is '1_0', not a number"),
    "nan": (f"{HEAD}\n{GOOD}".replace("0.02,1", "0.02,nan"), "line 4, vx: is nan"),
    "inf": (f"{HEAD}\n{GOOD}".replace("0.02,1", "0.02,-inf"), "line 4, vx: is -inf"),
    "row cut off": (f"{HEAD}\n{GOOD}\n1,2,3", "line 8: has 3 cells, the header has 8"),
    "row too long": (f"{HEAD}\n{GOOD},5", "has 9 cells"),
    "stamps back": (f"{HEAD}\n{GOOD}\n0.01,{ROW}", "line 8: t 0.010000 is before the row above"),
    "stamp twice": (f"{HEAD}\n{GOOD}\n0.05,{ROW}", "line 8: t 0.050000 comes twice"),
    "stamps in ns": ("\n".join([HEAD, *(f"{i * 10_000_000},{ROW}" for i in range(6))]), "goes in steps of 1e+07 s"),
    "no unit": (f"{HEAD}\n{GOOD}\n1,0,0,0,0,0,0,0.9", "line 8: the quaternion has length 0.9"),
    "zero quaternion": (f"{HEAD}\n{GOOD}\n1,0,0,0,0,0,0,0", "has length 0;"),
    "rotor missing": (f"{HEAD},T1,T3\n" + GOOD.replace(ROW, ROW + ",1,1"), "has T1 T3; number the rotors T1, T2"),
    "pwm from 0": (f"{HEAD},pwm2\n" + GOOD.replace(ROW, ROW + ",1"), "has pwm2; number the rotors"),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_broken_log_is_reported_in_one_line(tmp_path: Path, name: str) -> None:
    text, problem = BROKEN[name]
    path = tmp_path / "flight.csv"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_any(path)
    line = str(error.value)
    assert line.startswith(str(path)) and "\n" not in line and problem in line and "; " in line


def test_files_that_are_not_there_or_no_text(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_bytes(b"t,vx\n\xff\xfe")
    for path in (tmp_path / "none.csv", tmp_path, tmp_path / "b.csv"):
        with pytest.raises(InputError, match="give"):
            read_any(path)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError):
        write_flight(a_log(), tmp_path / "file" / "flight.csv")
    assert sorted(item.name for item in tmp_path.iterdir()) == ["b.csv", "file"]


def nanobench_text(acc: float = 1.0, pwm: float = 40000.0) -> str:
    head = "t,px,py,pz,qx,qy,qz,qw,vx,vy,vz,imu_acc_x,imu_acc_y,imu_acc_z,imu_gyro_x,imu_gyro_y,imu_gyro_z"
    motors = ",".join(f"motor_motor_m{i}" for i in range(1, 5))
    rows = [f"{i / 100},0,0,1,0,0,0,1,1,2,3,0,0,{acc},.1,.2,.3,{pwm},2,3,4,3.7" for i in range(6)]
    return "\n".join([f"{head},{motors},pwr_pm_vbat", *rows])


def test_nanobench_is_known_by_its_columns(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(nanobench_text())
    log = read_any(path)
    assert log.kind == "NanoBench" and log.total_thrust is None
    np.testing.assert_allclose(log.specific_force, np.tile([0, 0, 9.80665], (6, 1)))
    np.testing.assert_allclose(log.rates[0], [0.1, 0.2, 0.3])
    # A Crazyflie's motor 1 is the front right one, which is rotor 4 here.
    np.testing.assert_allclose(log.rotor_columns("pwm")[0], [4, 3, 2, 40000])
    assert log.extras["battery"][0] == 3.7


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (nanobench_text(acc=9.8), "where NanoBench is in g"),
        (nanobench_text(pwm=70000), "motor_motor_m1: goes from 70000"),
        (nanobench_text().replace("px,py,pz,qx", "x,y,z,wx"), "has qy qz qw without qx"),
        (nanobench_text().replace("t,px", "s,px"), "has no column t"),
    ],
)
def test_broken_nanobench(tmp_path: Path, text: str, problem: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=problem):
        read_nanobench(tmp_path / "a.csv")


def test_real_nanobench_logs() -> None:
    files = sorted(NANOBENCH.glob("*.csv"))
    if not files:
        pytest.skip("the real flights are not there (flight_nanobench in ../shared/data)")
    for file in files:
        log = read_any(file)
        assert len(log) > 4000 and log.specific_force is not None and log.rotor_columns("pwm").shape[1] == 4
        assert 0.9 < np.median(np.linalg.norm(log.specific_force, axis=1)) / 9.80665 < 1.1
        assert np.abs(np.gradient(log.position, log.t, axis=0) - log.velocity).mean() < 0.05
