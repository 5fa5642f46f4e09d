"""How much of a residual is noise: its spectrum above the motion's frequencies, carried down to the low-pass.

The noise of an accelerometer is about as strong at every frequency; that of differentiated velocities grows with the
square of the frequency in power, that of places differentiated twice with the fourth. What is seen above the cutoff is
fitted with these three, and says how much of them is below it. Forces of the air and the motors hardly reach there.
"""

from itertools import pairwise

import numpy as np

from depthsim.flight.fit.motion import CUTOFF
from depthsim.flight.table import Floats

_FROM, _TO = 1.25 * CUTOFF, 4.5 * CUTOFF
"""[Hz] the band in which all is noise."""
_BANDS = 8


def noise_levels(raw: Floats, rate: float) -> Floats:
    """(A,) standard deviation of the noise that is left after the low-pass, of residuals (N, A) before it."""
    count = len(raw)
    window = np.hanning(count)
    spectrum = np.abs(np.fft.rfft((raw - raw.mean(axis=0)) * window[:, None], axis=0)) ** 2
    density = 2 * spectrum / (rate * (window**2).sum())
    frequencies = np.asarray(np.fft.rfftfreq(count, 1 / rate), np.float64)
    edges = np.linspace(_FROM, min(_TO, 0.45 * rate), _BANDS + 1)
    middle = 0.5 * (edges[1:] + edges[:-1])
    shapes = _shapes(middle, rate)
    kept = (_passed(frequencies)[:, None] * _shapes(frequencies, rate)).sum(axis=0) * (frequencies[1] - frequencies[0])
    found = np.zeros(raw.shape[1])
    counts = np.diff(np.searchsorted(frequencies, edges))
    for axis in range(raw.shape[1]):
        # The median of an exponential distribution is ln 2 of its mean, and does not see single lines of vibration.
        level = np.array(
            [
                np.median(density[(frequencies >= low) & (frequencies < high), axis]) / np.log(2)
                for low, high in pairwise(edges)
            ]
        )
        if (level > 0).all():
            found[axis] = np.sqrt(_coefficients(shapes, level, counts) @ kept)
    return found


def _shapes(frequencies: Floats, rate: float) -> Floats:
    """(F, 3): white, differentiated once and twice, by central differences as they are taken here."""
    gain = np.sin(2 * np.pi * frequencies / rate) * rate / (2 * np.pi * CUTOFF)
    return np.stack([np.ones(len(frequencies)), gain**2, gain**4], axis=1)


def _coefficients(shapes: Floats, level: Floats, counts: Floats) -> Floats:
    """(3,) of the shapes; a steeper one only where the bands do not bear the flatter ones alone.

    With all three at once chance would give each its part, and none can be taken from the others again.
    """
    from scipy.optimize import nnls

    weights = np.sqrt(counts) / 1.44  # the median of exponential draws scatters by 1.44 over the root of their number
    found = np.zeros(3)
    least = np.inf
    for use in range(1, 4):
        model, value = shapes[:, :use], level
        for _ in range(3):  # weighed by the model: weighed by the data, low bands would count for more
            coefficients, _ = nnls(model * (weights / value)[:, None], level * weights / value)
            value = np.maximum(model @ coefficients, 1e-3 * level.min())
        misfit = float(((level / value - 1) ** 2 * weights**2).sum())
        if misfit > least - 9:
            break
        found[:use], least = coefficients, misfit
    return found


def _passed(frequencies: Floats) -> Floats:
    """Power that a Butterworth of second order lets through, forwards and backwards."""
    return np.asarray(1 / (1 + (frequencies / CUTOFF) ** 4) ** 2)
