"""From a path to what the controller is given at each step: differential flatness with rotor drag.

At a place of the path with velocity V and acceleration a the rotors must make the specific force

    (T/m) z = a + g e3 - F_drag(R, V, T) / m

along body z. In the rotors' plane most laws push back alike along x and y, F = -c V but for a part along z, and then z
is along a + g e3 + (c/m) V, as in Faessler, Franchi and Scaramuzza 2018; what differs between x and y, and a c that
depends on the thrust or the speed, is found by fixed-point iteration on top of that. The drag is that of a vehicle that
does not turn, its rotors sharing the thrust, in still air: a controller knows no better.

The angular rates ω = (Rᵀ dR/dt)^∨ and their derivative are taken by central differences of the eighth order over the
steps, good to 1e-13 and 1e-10 of full scale: that holds for any law.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.constants import GRAVITY
from depthsim.flight.controller import COLUMNS, FORCE, HEADING, RATES, SPIN, P, V, attitude
from depthsim.flight.drag import drag_slopes
from depthsim.flight.paths import Path
from depthsim.flight.vehicle import Vehicle
from depthsim.kernels import kernel

Floats = NDArray[np.float64]

_TAPS = (4 / 5, -1 / 5, 4 / 105, -1 / 280)
_REACH = len(_TAPS)


@dataclass(frozen=True)
class Reference:
    """A path as a vehicle's controller is given it, a row a step.

    rows: (N, C); controller.py names the columns. start: (13 + K,) the state that is on the path at 0 s.
    thrust: (N,) of all rotors that the path takes [N]. step: [s].
    """

    rows: Floats
    start: Floats
    thrust: Floats
    step: float


def make_reference(path: Path, vehicle: Vehicle, step: float = 1e-3, *, feedforward: bool = True) -> Reference:
    """The reference of a path for a vehicle; without ``feedforward`` it knows nothing of drag."""
    count = int(np.ceil(path.duration / step - 1e-9)) + 1
    ghosts = 2 * _REACH
    times = np.asarray(np.arange(-ghosts, count + ghosts) * step, np.float64)
    flat = path.flat(times)
    yaw = path.heading(flat)
    force, rotation = np.empty_like(flat[0]), np.empty((flat.shape[1], 3, 3))
    law, rotors = vehicle.drag.code if feedforward else 0, vehicle.rotors.count
    _flat_map(law, vehicle.drag_parameters, rotors, vehicle.mass, flat[1], flat[2], yaw, force, rotation)
    inner = rotation[_REACH:-_REACH]
    change = np.einsum("nji,njk->nik", inner, _derivative(rotation, step))
    rates = 0.5 * np.stack(
        [change[:, 2, 1] - change[:, 1, 2], change[:, 0, 2] - change[:, 2, 0], change[:, 1, 0] - change[:, 0, 1]],
        axis=1,
    )
    spin = _derivative(rates, step)
    kept = slice(ghosts, ghosts + count)
    rates = rates[_REACH : _REACH + count]
    rows = np.empty((count, COLUMNS))
    rows[:, P : P + 3], rows[:, V : V + 3], rows[:, FORCE : FORCE + 3] = flat[0, kept], flat[1, kept], force[kept]
    rows[:, HEADING], rows[:, HEADING + 1] = np.cos(yaw[kept]), np.sin(yaw[kept])
    rows[:, RATES : RATES + 3], rows[:, SPIN : SPIN + 3] = rates, spin
    thrust = vehicle.mass * np.linalg.norm(force[kept], axis=1)
    return Reference(rows, _state(vehicle, rows[0], rotation[ghosts], thrust[0]), thrust, step)


def _state(vehicle: Vehicle, row: Floats, rotation: Floats, thrust: float) -> Floats:
    inertia, rates = np.array(vehicle.inertia), row[RATES : RATES + 3]
    moment = inertia * row[SPIN : SPIN + 3] + np.cross(rates, inertia * rates)
    rotors = vehicle.mixer @ np.concatenate([[thrust], moment])
    rotors = np.clip(rotors, vehicle.rotors.min_thrust, vehicle.max_thrust)
    return np.concatenate([row[P : P + 3], row[V : V + 3], quaternion_of(rotation), rates, rotors])


def quaternion_of(rotation: Floats) -> Floats:
    """(4,) unit quaternion x y z w of a (3, 3) rotation matrix, w not negative (Bar-Itzhack 2000)."""
    r = rotation
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
            [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
            [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], 0],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]],
        ]
    )
    q = np.linalg.eigh(k, "L")[1][:, -1]
    return np.asarray(q if q[3] >= 0 else -q)


def _derivative(values: Floats, step: float) -> Floats:
    """(N - 8, ...) of (N, ...) values, by the eighth-order central difference."""
    count = len(values) - 2 * _REACH
    out = np.zeros((count, *values.shape[1:]))
    for reach, weight in enumerate(_TAPS, start=1):
        ahead, behind = _REACH + reach, _REACH - reach
        out += weight * (values[ahead : ahead + count] - values[behind : behind + count])
    return out / step


@kernel
def _flat_map(law, c, rotors, mass, velocity, acceleration, yaw, force, rotation):
    v = np.empty(3)
    for n in range(len(yaw)):
        vx, vy, vz = velocity[n, 0], velocity[n, 1], velocity[n, 2]
        gx, gy, gz = acceleration[n, 0], acceleration[n, 1], acceleration[n, 2] + GRAVITY
        cos, sin = np.cos(yaw[n]), np.sin(yaw[n])
        fx, fy, fz = gx, gy, gz
        for _ in range(100):
            xx, yx, zx, xy, yy, zy, xz, yz, zz = attitude(fx, fy, fz, cos, sin)
            v[0] = xx * vx + xy * vy + xz * vz
            v[1] = yx * vx + yy * vy + yz * vz
            v[2] = zx * vx + zy * vy + zz * vz
            cx, cy, cz = drag_slopes(law, c, rotors, v, mass * np.sqrt(fx * fx + fy * fy + fz * fz))
            mean, half = 0.5 * (cx + cy) / mass, 0.5 * (cx - cy) / mass
            ax = gx + mean * vx + half * (xx * v[0] - yx * v[1])
            ay = gy + mean * vy + half * (xy * v[0] - yy * v[1])
            az = gz + mean * vz + half * (xz * v[0] - yz * v[1])
            length = np.sqrt(ax * ax + ay * ay + az * az)
            along = (vx * ax + vy * ay + vz * az) / length
            size = (length + (cz / mass - mean) * along) / length
            ax, ay, az = size * ax, size * ay, size * az
            off = abs(ax - fx) + abs(ay - fy) + abs(az - fz)
            fx, fy, fz = ax, ay, az
            if off < 1e-14 * length:
                break
        force[n, 0], force[n, 1], force[n, 2] = fx, fy, fz
        xx, yx, zx, xy, yy, zy, xz, yz, zz = attitude(fx, fy, fz, cos, sin)
        rotation[n, 0, 0], rotation[n, 0, 1], rotation[n, 0, 2] = xx, yx, zx
        rotation[n, 1, 0], rotation[n, 1, 1], rotation[n, 1, 2] = xy, yy, zy
        rotation[n, 2, 0], rotation[n, 2, 1], rotation[n, 2, 2] = xz, yz, zz
