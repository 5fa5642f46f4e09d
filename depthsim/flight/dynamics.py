"""The motion of multirotors: rigid bodies with quaternions, motor lag, drag, wind, ground effect; RK4, many at once.

State of a vehicle, S = 13 + K numbers: position and velocity (world), quaternion x y z w (body to world), angular rates
(body), and the thrusts of its K rotors.

    p' = V    V' = R F / m - g e3    q' = q ⊗ (ω, 0) / 2    J ω' = M - ω × Jω    T' = (command - T) / τ

F and M are the rotors' thrusts and the drag law's force and moment, in the body frame. The classical Runge-Kutta method
of fourth order; commands are held over a step, and the quaternion is made unit after it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.constants import GRAVITY
from depthsim.flight.controller import control
from depthsim.flight.drag import drag
from depthsim.flight.fleet import Craft, Fleet
from depthsim.flight.ground_effect import ground_factor
from depthsim.flight.wind import Air, wind_at
from depthsim.kernels import kernel
from depthsim.parallel import core_count, split

Floats = NDArray[np.float64]

BODY = 13
"""Numbers in a state before the rotors' thrusts."""


class Motion(NamedTuple):
    """What V vehicles did, at L stamps.

    t: (L,) [s]. states: (V, L, S); see the head of this file. specific_force: (V, L, 3) in the body [m/s²].
    """

    t: Floats
    states: Floats
    specific_force: Floats


def simulate(
    fleet: Fleet,
    air: Air,
    states: Floats,
    *,
    step: float,
    steps: int,
    every: int = 1,
    references: Floats | None = None,
    which: NDArray[np.int64] | None = None,
    commands: Floats | None = None,
    threads: int | None = None,
) -> Motion:
    """Fly V vehicles for ``steps`` steps of ``step`` [s], and keep every so many of them, the first one included.

    states: (V, S) at the start. references: (R, steps + 1, C) to be tracked, as reference.py makes them, and ``which``
    (V,) of them each vehicle follows, the first if not given. commands: (V, K) constant thrusts in place of them [N].
    threads: all cores by default; the result does not depend on it, nor on the other vehicles.
    """
    count, size = states.shape
    rows = references if references is not None else np.empty((1, 0, 1))
    if references is not None and references.shape[1] < steps + 1:
        raise ValueError(f"{steps} steps need {steps + 1} rows of reference, not {references.shape[1]}")
    follows = np.zeros(count, np.int64) if which is None else np.asarray(which, np.int64)
    held = commands if commands is not None else np.zeros((count, size - BODY))
    kept = steps // every + 1
    out, force = np.empty((count, kept, size)), np.empty((count, kept, 3))
    threads = min(threads or core_count(), count)
    split(_fly, count, threads, fleet, air, rows, follows, held, step, steps, every, states.copy(), out, force)
    stamps = np.asarray(np.arange(kept) * (step * every), np.float64)
    return Motion(stamps, out, force)


@kernel
def _derivative(time, y, command, craft, air, i, dy):
    """The state's derivative into ``dy``, and the force [N] that is not gravity, along body x, y, z."""
    qx, qy, qz, qw = y[6], y[7], y[8], y[9]
    r00, r01, r02 = 1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy - qz * qw), 2 * (qx * qz + qy * qw)
    r10, r11, r12 = 2 * (qx * qy + qz * qw), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz - qx * qw)
    r20, r21, r22 = 2 * (qx * qz - qy * qw), 2 * (qy * qz + qx * qw), 1 - 2 * (qx * qx + qy * qy)
    ax, ay, az = wind_at(air, i, time, y[0], y[1], y[2])
    ux, uy, uz = y[3] - ax, y[4] - ay, y[5] - az
    vx, vy, vz = r00 * ux + r10 * uy + r20 * uz, r01 * ux + r11 * uy + r21 * uz, r02 * ux + r12 * uy + r22 * uz
    wx, wy, wz = y[10], y[11], y[12]
    c = craft.drag
    fx, fy, fz, mx, my, mz = drag(
        craft.law[0], c[0, 0], c[0, 1], c[0, 2], craft.places, vx, vy, vz, wx, wy, wz, y, BODY
    )
    for n in range(1, len(craft.law)):
        more = drag(craft.law[n], c[n, 0], c[n, 1], c[n, 2], craft.places, vx, vy, vz, wx, wy, wz, y, BODY)
        fx, fy, fz, mx, my, mz = fx + more[0], fy + more[1], fz + more[2], mx + more[3], my + more[4], mz + more[5]
    near_ground = air.ground > -np.inf
    for rotor in range(len(command)):
        thrust = y[BODY + rotor]
        push = thrust * craft.scale[rotor]
        if near_ground:
            px, py, pz = craft.places[rotor, 0], craft.places[rotor, 1], craft.places[rotor, 2]
            height = y[2] + r20 * px + r21 * py + r22 * pz - air.ground
            push *= ground_factor(height, craft.radius, craft.ground[0], craft.ground[1], craft.ground[2])
        fz += push
        mx += craft.allocation[1, rotor] * push
        my += craft.allocation[2, rotor] * push
        # The air's torque on a propeller goes with what the motor does, near the ground too.
        mz += craft.allocation[3, rotor] * thrust
        dy[BODY + rotor] = (command[rotor] - thrust) / craft.lag if craft.lag > 0 else 0.0
    mass = craft.mass
    for axis in range(3):
        dy[axis] = y[3 + axis]
    dy[3] = (r00 * fx + r01 * fy + r02 * fz) / mass
    dy[4] = (r10 * fx + r11 * fy + r12 * fz) / mass
    dy[5] = (r20 * fx + r21 * fy + r22 * fz) / mass - GRAVITY
    dy[6] = 0.5 * (qw * wx + qy * wz - qz * wy)
    dy[7] = 0.5 * (qw * wy + qz * wx - qx * wz)
    dy[8] = 0.5 * (qw * wz + qx * wy - qy * wx)
    dy[9] = -0.5 * (qx * wx + qy * wy + qz * wz)
    jx, jy, jz = craft.inertia[0], craft.inertia[1], craft.inertia[2]
    dy[10] = (mx + (jy - jz) * wy * wz) / jx
    dy[11] = (my + (jz - jx) * wz * wx) / jy
    dy[12] = (mz + (jx - jy) * wx * wy) / jz
    return fx, fy, fz


@kernel
def _fly(start, stop, fleet, air, references, which, commands, step, steps, every, states, out, forces):
    size, tracked = states.shape[1], references.shape[1] > 0
    k1, k2, k3, k4, mid = np.empty(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    command = np.empty(size - BODY)
    for i in range(start, stop):
        y, reference = states[i], references[which[i]]
        craft = Craft(
            fleet.mass[i],
            fleet.inertia[i],
            fleet.places[i],
            fleet.radius[i],
            fleet.allocation[i],
            fleet.mixer[i],
            fleet.lag[i],
            fleet.limits[i],
            fleet.scale[i],
            fleet.law[i],
            fleet.drag[i],
            fleet.ground[i],
            fleet.gains[i],
        )
        command[:] = commands[i]
        for index in range(steps + 1):
            time = index * step
            if tracked:
                control(y, reference, index, craft, command)
            if craft.lag <= 0:
                y[BODY:] = command
            fx, fy, fz = _derivative(time, y, command, craft, air, i, k1)
            if index % every == 0:
                row = index // every
                for n in range(size):
                    out[i, row, n] = y[n]
                forces[i, row, 0], forces[i, row, 1] = fx / craft.mass, fy / craft.mass
                forces[i, row, 2] = fz / craft.mass
            if index == steps:
                break
            for n in range(size):
                mid[n] = y[n] + 0.5 * step * k1[n]
            _derivative(time + 0.5 * step, mid, command, craft, air, i, k2)
            for n in range(size):
                mid[n] = y[n] + 0.5 * step * k2[n]
            _derivative(time + 0.5 * step, mid, command, craft, air, i, k3)
            for n in range(size):
                mid[n] = y[n] + step * k3[n]
            _derivative(time + step, mid, command, craft, air, i, k4)
            for n in range(size):
                y[n] += step / 6 * (k1[n] + 2 * (k2[n] + k3[n]) + k4[n])
            length = np.sqrt(y[6] * y[6] + y[7] * y[7] + y[8] * y[8] + y[9] * y[9])
            for n in range(6, 10):
                y[n] /= length
