"""The plane that a camera sees, in one depth picture."""

import numpy as np
from numpy.typing import NDArray

from depthsim.material_fit.spread import robust_deviation

PARAMETERS = 3
_MOST_PIXELS = 20_000
_STEPS = 12


def plane_depth(
    depth: NDArray[np.float32], x: NDArray[np.float32], y: NDArray[np.float32], unit: float
) -> NDArray[np.float64]:
    """The depth of the plane that fits ``depth`` best, at the same pixels, (n,) [m].

    A plane that is seen along the rays (x, y, 1) has 1 / Z = p·x + q·y + r. Pixel coordinates serve as well as x and y,
    as they differ by a linear map. The fit is least squares in Z, where the noise is (in 1 / Z strong noise gives a
    bias), by Gauss and Newton's method; what is beyond three robust deviations is left out of each step.
    """
    design = np.stack([x, y, np.ones_like(x)], axis=1).astype(np.float64)
    every = -(-depth.size // _MOST_PIXELS)
    near, z = design[::every], depth[::every].astype(np.float64)
    plane = np.array([0, 0, 1 / np.median(z)])
    for _ in range(_STEPS):
        model = 1 / (near @ plane)
        errors = z - model
        middle, deviation = robust_deviation(errors)
        inside = np.abs(errors - middle) <= 3 * max(deviation, unit)
        slope = -near[inside] * model[inside, None] ** 2
        step = np.linalg.lstsq(slope, errors[inside], rcond=None)[0]
        if not (design @ (plane + step) > 0).all():
            break  # such a plane passes behind the camera
        plane = plane + step
        if np.abs(slope @ step).max() < 1e-3 * unit:
            break
    return np.asarray(1 / (design @ plane))
