"""Winds of five forms for the withheld benchmark, by formulas that the diagnosis does not have.

A constant wind; one that swings as a sine about its mean (a wind tunnel: 8.5 ± 2.4 m/s); one that steps; one that
drifts; and turbulence after Dryden about a mean, shaped in the frequency domain (MIL-F-8785C's spectra).
"""

from collections.abc import Callable

import numpy as np

from benchmarks.withheld_flight_data import SECONDS, Truth

Floats = np.ndarray
Rng = np.random.Generator
STEP = 0.01


def _time() -> Floats:
    return np.arange(round((SECONDS + 2) / STEP)) * STEP


def _directions(rng: Rng) -> tuple[Floats, Floats]:
    """Along the mean wind and across it."""
    angle = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])


def constant(rng: Rng, mean: float) -> Floats:
    along, _ = _directions(rng)
    return np.tile(mean * along, (len(_time()), 1))


def sine(rng: Rng, mean: float) -> Floats:
    """With 20 to 40 % of the mean, in 3 to 20 s."""
    along, _ = _directions(rng)
    swing = rng.uniform(0.2, 0.4) * np.sin(2 * np.pi * _time() / rng.uniform(3, 20) + rng.uniform(0, 6.3))
    return mean * (1 + swing)[:, None] * along


def step(rng: Rng, mean: float) -> Floats:
    """From one speed and direction to another within half a second, once or twice."""
    along, across = _directions(rng)
    t, wind = _time(), np.tile(mean * along, (len(_time()), 1))
    for at in rng.uniform(8, 38, int(rng.integers(1, 3))):
        jump = mean * (rng.choice([-1, 1]) * rng.uniform(0.3, 0.6) * along + rng.uniform(-0.3, 0.3) * across)
        wind += 0.5 * (1 + np.tanh((t - at) / 0.25))[:, None] * jump
    return wind


def drift(rng: Rng, mean: float) -> Floats:
    """Grows or falls by half and turns by up to 40 degrees, slowly, not in a straight line."""
    along, across = _directions(rng)
    share = (_time() / SECONDS) ** rng.uniform(0.6, 1.8) - 0.5
    size, turn = 1 + rng.choice([-1, 1]) * rng.uniform(0.3, 0.6) * share, rng.uniform(-0.7, 0.7) * share
    return mean * size[:, None] * (np.cos(turn)[:, None] * along + np.sin(turn)[:, None] * across)


def dryden(rng: Rng, mean: float) -> Floats:
    """Longitudinal and lateral spectra by their length L = 4 to 15 m at the mean wind; 15 to 30 % of the mean."""
    along, across = _directions(rng)
    count = len(_time())
    length, sigma = rng.uniform(4, 15), rng.uniform(0.15, 0.3) * mean
    scaled = (length / mean) * 2 * np.pi * np.fft.rfftfreq(count, STEP)
    shapes = (1 / (1 + scaled**2), (1 + 3 * scaled**2) / (1 + scaled**2) ** 2)
    wind = np.tile(mean * along, (count, 1))
    for shape, way in zip(shapes, (along, across), strict=True):
        spectrum = np.sqrt(shape) * (rng.normal(size=len(scaled)) + 1j * rng.normal(size=len(scaled)))
        series = np.fft.irfft(spectrum, count)
        wind += (sigma * series / series.std())[:, None] * way
    return wind


FORMS: dict[str, Callable[[Rng, float], Floats]] = {
    "constant": constant,
    "sine": sine,
    "step": step,
    "drift": drift,
    "dryden": dryden,
}


def wind(rng: Rng, form: str) -> Truth:
    """A wind of a form, 2.5 to 10 m/s in the mean."""
    return Truth(wind=FORMS[form](rng, float(rng.uniform(2.5, 10))))


def mean_of(truth: Truth) -> Floats:
    """(2,) the mean over what the log has [m/s]."""
    return np.asarray(_logged(truth).mean(axis=0))


def gusts_of(truth: Truth, start: float, end: float) -> dict[str, list[float]]:
    """Mean, standard deviation and correlation time from a second to another, as a report names them."""
    wind = _logged(truth, start, end)
    calm = wind - wind.mean(axis=0)
    alike = sum(np.correlate(column, column, "full")[len(calm) - 1 :] for column in calm.T)
    seconds = STEP * int(np.argmax(alike < alike[0] / np.e))
    spread = float(np.sqrt((calm**2).mean()))
    return {"velocity": wind.mean(axis=0).tolist(), "intensity": [spread], "correlation_time": [seconds]}


def _logged(truth: Truth, start: float = 0.5, end: float = SECONDS) -> Floats:
    assert truth.wind is not None
    return np.asarray(truth.wind[round(start / STEP) : round(end / STEP), :2])
