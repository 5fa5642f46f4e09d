"""Wind: gusts with the spectrum of the standard, fields on a grid, and what a user may name."""

from pathlib import Path

import numpy as np
import pytest

from depthsim.errors import InputError
from depthsim.flight.dryden import GUST_STEP
from depthsim.flight.wind import (
    FOOT,
    ConstantWind,
    Gusts,
    Shear,
    WindField,
    make_air,
    wind_at,
)
from depthsim.flight.windfile import read_grid, resolve_wind


def test_gusts_have_the_standards_deviations_and_scales() -> None:
    """MIL-F-8785C, low altitude: at 1,000 ft all deviations are 0.1 W20 and all lengths 1,000 ft."""
    gusts = Gusts(velocity=(10, 0, 0))
    assert gusts.scales(1000 * FOOT) == pytest.approx((1.0, 1.0, 304.8, 304.8))
    along, vertical, length, length_w = gusts.scales(100 * FOOT)
    assert (along, vertical) == pytest.approx((1 / 0.2593**0.4, 1.0))
    assert (length, length_w) == pytest.approx((30.48 / 0.2593**1.2, 30.48))
    assert gusts.scales(0.1) == gusts.scales(10 * FOOT)


def test_gusts_have_the_standards_spectrum() -> None:
    wind = Gusts(velocity=(0, 10, 0))  # u is along the wind: along y, and v along -x
    altitude, speed = 20.0, 10.0
    series = wind.gusts(600, altitude, speed, range(40))
    along, vertical, length, length_w = wind.scales(altitude)
    deviations = series.std(axis=(0, 1))
    np.testing.assert_allclose(deviations, [along, along, vertical], rtol=0.05)
    window = np.hanning(8192)
    power = []
    for part in range(0, series.shape[1] - 8192, 4096):
        block = series[:, part : part + 8192] * window[:, None]
        power.append(np.abs(np.fft.rfft(block, axis=1)) ** 2)
    density = np.mean(power, axis=(0, 1)) * 2 * GUST_STEP / np.sum(window**2)
    omega = 2 * np.pi * np.fft.rfftfreq(8192, GUST_STEP)
    band = (omega > 0.3) & (omega < 60)
    for axis, sigma, scale in ((1, along, length), (0, along, length), (2, vertical, length_w)):
        x = (scale / speed * omega[band]) ** 2
        shape = 2 / (1 + x) if axis == 1 else (1 + 3 * x) / (1 + x) ** 2
        wanted = 2 * sigma**2 * scale / speed * shape  # one-sided, per Hz
        smooth = np.convolve(density[band, axis] / wanted, np.ones(25) / 25, "valid")
        np.testing.assert_allclose(smooth, 1, atol=0.12)


def test_gusts_come_by_seed_and_not_by_neighbour() -> None:
    wind = Gusts(velocity=(5, 5, 0))
    together = wind.gusts(5, 10, 5, (3, 8, 3))
    assert together[0].tobytes() == together[2].tobytes() == wind.gusts(5, 10, 5, (3,))[0].tobytes()
    assert np.abs(together[0] - together[1]).max() > 0.1


def test_field_is_linear_between_its_places_and_flat_beyond() -> None:
    def field(p: np.ndarray) -> np.ndarray:
        return p @ np.array([[1, 0.5, 0], [0, 2, -1], [0.3, 0, 1]]) + [1, 2, 3]

    grid = WindField.sampled(field, (-1, 0, 2), (1, 3, 4), 0.5)
    air = make_air(None)._replace(field=grid.velocity, origin=grid.origin, spacing=grid.spacing)
    rng = np.random.default_rng(0)
    for place in rng.uniform([-1, 0, 2], [1, 3, 4], (50, 3)):
        np.testing.assert_allclose(wind_at(air, 0, 0.0, *place), field(place[None])[0], atol=1e-12)
    corner = field(np.array([[1.0, 3, 4]]))[0]
    np.testing.assert_allclose(wind_at(air, 0, 0.0, 9.0, 9.0, 9.0), corner, atol=1e-12)


def test_shear_follows_the_power_law() -> None:
    air = make_air(Shear(velocity=(8, 0, 0), height=10, exponent=0.2))
    for z in (0.5, 3.0, 10.0, 40.0):
        assert wind_at(air, 0, 0.0, 5.0, 5.0, z)[0] == pytest.approx(8 * (z / 10) ** 0.2, rel=2e-3)
    assert wind_at(air, 0, 0.0, 0.0, 0.0, -3.0)[0] == 0


def test_what_a_user_may_name(tmp_path: Path) -> None:
    assert resolve_wind("3/0/-1") == ConstantWind(velocity=(3, 0, -1))
    assert resolve_wind("gusts:velocity=6/0/0,altitude=5") == Gusts(velocity=(6, 0, 0), altitude=5)
    (tmp_path / "w.csv").write_text("x,y,z,wx,wy,wz\n0,0,0,1,0,0\n1,0,0,2,0,0\n")
    (tmp_path / "w.yaml").write_text("{kind: field, file: w.csv}")
    for name in ("w.csv", "w.yaml"):
        air = make_air(resolve_wind(str(tmp_path / name)))
        assert wind_at(air, 0, 0.0, 0.25, 7.0, 7.0)[0] == pytest.approx(1.25)


BROKEN_GRIDS = {
    "x,y,z,wx,wy\n0,0,0,1,0\n": "has no column wz",
    "x,y,z,wx,wy,wz\n0,0,0,1,0,0\n0,0,0,1,0,0\n": "has 2 places",
    "x,y,z,wx,wy,wz\n0,0,0,1,0,0\n1,1,0,1,0,0\n": "has 2 places, not 2 x 2 x 1",
    "x,y,z,wx,wy,wz\n": "has no places under its header",
    "x,y,z,wx,wy,wz\n0,0,0,1,0,0\n1,0,0,1,0,0\n3,0,0,1,0,0\n": "goes in steps of 1 to 2 m",
    "x,y,z,wx,wy,wz\n0,0,0,nan,0,0\n": "is nan",
}


@pytest.mark.parametrize("text", BROKEN_GRIDS)
def test_broken_grids(text: str, tmp_path: Path) -> None:
    (tmp_path / "w.csv").write_text(text)
    with pytest.raises(InputError, match=r"w\.csv") as caught:
        read_grid(tmp_path / "w.csv")
    assert BROKEN_GRIDS[text] in str(caught.value)


@pytest.mark.parametrize(
    ("choice", "reported"),
    [
        ("3/0", "is no wind"),
        ("strong", "is no wind"),
        ("gusts:velocity=6/0", "wind.gusts.velocity"),
        ("gusts:velocity=6/0/0,altitude=-1", "greater than 0"),
        ("storm:velocity=6/0/0", "'storm'"),
        ("constant:velocity=900/0/0", "less than or equal to 200"),
        ("field:file=/etc/passwd", "give the file itself"),
        ("gone.yaml", "no such file"),
        ("gone.csv", "no such file"),
    ],
)
def test_broken_winds(choice: str, reported: str) -> None:
    with pytest.raises(InputError) as caught:
        resolve_wind(choice)
    assert reported in str(caught.value) and "\n" not in str(caught.value)


def test_a_grid_may_not_leave_its_folder(tmp_path: Path) -> None:
    (tmp_path / "w.yaml").write_text("{kind: field, file: ../other.csv}")
    with pytest.raises(InputError, match="leaves the folder"):
        resolve_wind(str(tmp_path / "w.yaml"))
