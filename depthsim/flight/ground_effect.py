"""The ground effect: near the ground a rotor pushes harder at the same power.

Cheeseman and Bennett 1955: T / T∞ = 1 / (1 - (R / 4z)²) for a rotor of radius R at the height z above level ground. The
formula has a pole at z = R/4 and was confirmed above z = R/2 only, so the ratio is held at its value there, 4/3.
"""

from depthsim.kernels import kernel

LEAST_HEIGHT = 0.5
"""Over the rotor's radius."""


@kernel
def ground_factor(height, radius):  # noqa: ANN201 - numba
    """Thrust near the ground over thrust far from it, 1 to 4/3."""
    part = radius / (4 * max(height, LEAST_HEIGHT * radius))
    return 1 / (1 - part * part)
