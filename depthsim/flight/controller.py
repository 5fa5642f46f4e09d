"""The tracking controller: differential flatness with rotor drag, and geometric attitude control.

The reference brings what flatness gives (reference.py): the specific force f_ref = a + g e3 - drag/m that the rotors
must make, the yaw, and the angular rates and their derivative that belong to it (Faessler, Franchi and Scaramuzza 2018,
with the drag left out where feed-forward is off). Feedback adds to the force:

    f = f_ref + k_p (p_ref - p) + k_v (V_ref - V)          z_d along f          T = m f · R e3

The attitude follows as in Lee, Leok and McClamroch 2010, with gains over the inertia, so that all axes are alike:

    M = J (-k_R e_R - k_ω e_ω + R^T R_d ω'_ref - ω × R^T R_d ω_ref) + ω × Jω

where e_R = (R_d^T R - R^T R_d)^∨ / 2 and e_ω = ω - R^T R_d ω_ref.
"""

import numpy as np

from depthsim.kernels import inlined, kernel

P, V, FORCE, HEADING, RATES, SPIN = 0, 3, 6, 9, 11, 14
"""Where a row of a reference has position, velocity, f_ref, cos and sin of the yaw, ω_ref and ω'_ref."""
COLUMNS = 17

_LEAST_FORCE = 1e-6
"""[m/s²] Less than this points nowhere; the attitude is then left as it is."""


@kernel
def attitude(fx, fy, fz, c, s):  # noqa: ANN201 - numba
    """The nine entries, row by row, of the rotation whose z is along (fx, fy, fz) and whose x points to the yaw."""
    length = np.sqrt(fx * fx + fy * fy + fz * fz)
    zx, zy, zz = fx / length, fy / length, fz / length
    # x = y_c × z with y_c = (-s, c, 0); it vanishes only where z is level and points along the vehicle's left.
    xx, xy, xz = c * zz, s * zz, -s * zy - c * zx
    length = np.sqrt(xx * xx + xy * xy + xz * xz)
    xx, xy, xz = xx / length, xy / length, xz / length
    return xx, zy * xz - zz * xy, zx, xy, zz * xx - zx * xz, zy, xz, zx * xy - zy * xx, zz


@inlined
def control(y, rows, n, craft, command):  # noqa: ANN201 - numba
    """The thrusts that a controller asks for in state ``y`` at row ``n`` of a reference, into ``command`` (K,)."""
    k_p, k_v, k_r, k_w = craft.gains[0], craft.gains[1], craft.gains[2], craft.gains[3]
    fx = rows[n, FORCE] + k_p * (rows[n, P] - y[0]) + k_v * (rows[n, V] - y[3])
    fy = rows[n, FORCE + 1] + k_p * (rows[n, P + 1] - y[1]) + k_v * (rows[n, V + 1] - y[4])
    fz = rows[n, FORCE + 2] + k_p * (rows[n, P + 2] - y[2]) + k_v * (rows[n, V + 2] - y[5])
    a, b, z, w = y[6], y[7], y[8], y[9]
    r00, r01, r02 = 1 - 2 * (b * b + z * z), 2 * (a * b - z * w), 2 * (a * z + b * w)
    r10, r11, r12 = 2 * (a * b + z * w), 1 - 2 * (a * a + z * z), 2 * (b * z - a * w)
    r20, r21, r22 = 2 * (a * z - b * w), 2 * (b * z + a * w), 1 - 2 * (a * a + b * b)
    thrust = craft.mass * max(fx * r02 + fy * r12 + fz * r22, 0.0)
    if fx * fx + fy * fy + fz * fz < _LEAST_FORCE * _LEAST_FORCE:
        fx, fy, fz = r02, r12, r22
    d00, d01, d02, d10, d11, d12, d20, d21, d22 = attitude(fx, fy, fz, rows[n, HEADING], rows[n, HEADING + 1])
    # E = R^T R_d, from the wanted body frame to the one that is.
    e00, e01, e02 = (
        r00 * d00 + r10 * d10 + r20 * d20,
        r00 * d01 + r10 * d11 + r20 * d21,
        r00 * d02 + r10 * d12 + r20 * d22,
    )
    e10, e11, e12 = (
        r01 * d00 + r11 * d10 + r21 * d20,
        r01 * d01 + r11 * d11 + r21 * d21,
        r01 * d02 + r11 * d12 + r21 * d22,
    )
    e20, e21, e22 = (
        r02 * d00 + r12 * d10 + r22 * d20,
        r02 * d01 + r12 * d11 + r22 * d21,
        r02 * d02 + r12 * d12 + r22 * d22,
    )
    wx, wy, wz = rows[n, RATES], rows[n, RATES + 1], rows[n, RATES + 2]
    ux, uy, uz = e00 * wx + e01 * wy + e02 * wz, e10 * wx + e11 * wy + e12 * wz, e20 * wx + e21 * wy + e22 * wz
    wx, wy, wz = rows[n, SPIN], rows[n, SPIN + 1], rows[n, SPIN + 2]
    sx, sy, sz = e00 * wx + e01 * wy + e02 * wz, e10 * wx + e11 * wy + e12 * wz, e20 * wx + e21 * wy + e22 * wz
    wx, wy, wz = y[10], y[11], y[12]
    jx, jy, jz = craft.inertia[0], craft.inertia[1], craft.inertia[2]
    turn_x = -0.5 * k_r * (e12 - e21) - k_w * (wx - ux) + sx - (wy * uz - wz * uy)
    turn_y = -0.5 * k_r * (e20 - e02) - k_w * (wy - uy) + sy - (wz * ux - wx * uz)
    turn_z = -0.5 * k_r * (e01 - e10) - k_w * (wz - uz) + sz - (wx * uy - wy * ux)
    mx = jx * turn_x + (jz - jy) * wy * wz
    my = jy * turn_y + (jx - jz) * wz * wx
    mz = jz * turn_z + (jy - jx) * wx * wy
    _mix(craft, thrust, mx, my, mz, command)


@inlined
def _mix(craft, thrust, mx, my, mz, command):
    """Thrusts within the rotors' limits; where they are short the yaw gives way first."""
    low, high = craft.limits[0], craft.limits[1]
    share = 1.0
    for rotor in range(len(command)):
        rest = craft.mixer[rotor, 0] * thrust + craft.mixer[rotor, 1] * mx + craft.mixer[rotor, 2] * my
        yaw = craft.mixer[rotor, 3] * mz
        rest = min(max(rest, low), high)
        command[rotor] = rest
        if rest + yaw > high:
            share = min(share, (high - rest) / yaw)
        elif rest + yaw < low:
            share = min(share, (low - rest) / yaw)
    for rotor in range(len(command)):
        command[rotor] += share * craft.mixer[rotor, 3] * mz
