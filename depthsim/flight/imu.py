"""The IMU of a RealSense D435i, a Bosch BMI055: noise, bias walk, range and resolution.

Rates and ranges: gyroscope 200 or 400 Hz, ±1000 °/s; accelerometer 62.5 or 250 Hz, ±4 g (librealsense pull request
2777, D435i with BMI055; later units carry a BMI085 with 100 and 200 Hz). So there is no accelerometer of 200 or 400 Hz
in this camera: it is sampled at 250 Hz and brought to the gyroscope's stamps by straight lines, as realsense-ros does
with unite_imu_method linear_interpolation.
Noise densities: datasheet BST-BMI055-DS000, typical: 0.014 °/s/√Hz and 150 µg/√Hz. Resolution: 16 bits of ±1000 °/s
(32.8 to the °/s) and 12 bits of ±4 g (512 to the g), the same.
Bias walks: Kalibr's figures of one D435i, 2.4e-6 rad/s²/√Hz and 6.3e-5 m/s³/√Hz (VINS-Mono issue 472); ORB-SLAM3's
configuration for the D435i has 1e-6 and 1e-4. Both biases start at zero: that of a calibrated unit, an assumption.

Samples are in the camera's optical frame, as librealsense gives them, and the IMU sits at its origin; the real one is
about 2 cm away.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.constants import GRAVITY

Floats = NDArray[np.float64]

GYRO_RATES = (200, 400)
"""[Hz]"""
ACCEL_RATE = 250
"""[Hz]"""


@dataclass(frozen=True)
class Channel:
    """Three axes of one kind: continuous noise density, bias walk, range and resolution, each in the sensor's unit."""

    density: float
    walk: float
    limit: float
    resolution: float

    def measure(self, truth: Floats, rate: float, rng: np.random.Generator) -> Floats:
        """(N, 3) what is read of the (N, 3) truth, sampled at ``rate`` [Hz]."""
        noise, steps = rng.normal(size=(2, *truth.shape))
        bias = np.cumsum(self.walk / math.sqrt(rate) * steps, axis=0)
        read = truth + bias + self.density * math.sqrt(rate) * noise
        return np.asarray(np.clip(np.round(read / self.resolution) * self.resolution, -self.limit, self.limit))


GYROSCOPE = Channel(math.radians(0.014), 2.4e-6, math.radians(1000), math.radians(1 / 32.8))
"""[rad/s]"""
ACCELEROMETER = Channel(150e-6 * GRAVITY, 6.3e-5, 4 * GRAVITY, GRAVITY / 512)
"""[m/s²]"""


def imu_samples(t: Floats, rates: Floats, force: Floats, gyro_rate: int, seed: int) -> Mapping[str, Floats]:
    """The columns of imu.csv: t, wx wy wz [rad/s] and ax ay az [m/s²], a row for each sample of the gyroscope.

    t: (N,) stamps of the truth [s]. rates, force: (N, 3) angular rates and specific force in the sensor's frame.
    """
    if gyro_rate not in GYRO_RATES:
        raise ValueError(f"the gyroscope has {GYRO_RATES} Hz, not {gyro_rate}")
    rng = np.random.Generator(np.random.Philox(key=[seed, 0x1A0]))
    duration = t[-1] - t[0]
    gyro_stamps = t[0] + np.arange(math.floor(duration * gyro_rate + 1e-6) + 1) / gyro_rate
    accel_stamps = t[0] + np.arange(math.floor(duration * ACCEL_RATE + 1e-6) + 1) / ACCEL_RATE
    gyro = GYROSCOPE.measure(_at(gyro_stamps, t, rates), gyro_rate, rng)
    accel = _at(gyro_stamps, accel_stamps, ACCELEROMETER.measure(_at(accel_stamps, t, force), ACCEL_RATE, rng))
    columns = np.hstack([gyro, accel]).T
    return {"t": gyro_stamps, **dict(zip(("wx", "wy", "wz", "ax", "ay", "az"), columns, strict=True))}


def _at(wanted: Floats, t: Floats, values: Floats) -> Floats:
    return np.stack([np.interp(wanted, t, column) for column in values.T], axis=1)
