"""The m of a material from std against distance: std(d) = floor·exp(m·d), section 2 of the paper.

"High-Fidelity Drone Simulation with Depth Camera Noise and Improved Air Drag Force Models", Appl. Sci. 2023, 13(19),
10631, has floor = 0.005 m. On a logarithmic scale the law is a straight line through the floor, so m is a slope.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from depthsim.errors import InputError
from depthsim.material_fit.curve import Curve
from depthsim.material_fit.laws import Floats, LawFit, fit_law, log_std

PAPER_FLOOR = 0.005
"""[m] std at zero range in the paper's law."""
DECIDED = 4.0
"""A law whose AIC is higher by this much has "considerably less" support (Burnham and Anderson 2002, section 2.6)."""

SpreadKind = Literal["spatial", "temporal"]


@dataclass(frozen=True)
class MaterialFit:
    """The paper's law fitted to one material.

    m: [1/m], with its 95 % confidence interval. floor: [m]; its interval is None where it was held fixed. Both
    intervals count the scatter of the points about the curve. They hold for the law: where another law is the better
    one, they only describe the best curve through these distances.
    n: points. span: nearest and farthest distance [m].
    law, quadratic: the paper's law, and std = k·d², the noise of a stereo camera with a constant disparity error.
    """

    tag: str
    m: float
    ci95: tuple[float, float]
    floor: float
    floor_ci95: tuple[float, float] | None
    n: int
    span: tuple[float, float]
    law: LawFit
    quadratic: LawFit

    @property
    def r2(self) -> float:
        """R² of the stds against the law."""
        return self.law.r2

    @property
    def rmse(self) -> float:
        """Root mean square distance of the stds from the law [m]."""
        return self.law.rmse

    @property
    def k(self) -> float:
        """std = k·d² [1/m]; times f·b it is the std of the disparity [px]."""
        return float(np.exp(self.quadratic.parameters[0]))

    @property
    def better(self) -> Literal["exponential", "quadratic", "undecided"]:
        """Which law describes the points better, by Akaike's criterion."""
        gain = self.quadratic.aic - self.law.aic
        if abs(gain) < DECIDED:
            return "undecided"
        return "exponential" if gain > 0 else "quadratic"

    @property
    def m_text(self) -> tuple[str, str, str]:
        """m and the ends of its interval, to as many decimals as the interval gives reason for."""
        half = max((self.ci95[1] - self.ci95[0]) / 2, 1e-6)
        decimals = int(np.clip(1 - np.floor(np.log10(half)), 2, 6))
        return f"{self.m:.{decimals}f}", f"{self.ci95[0]:.{decimals}f}", f"{self.ci95[1]:.{decimals}f}"

    def std(self, distance: ArrayLike) -> NDArray[np.float64]:
        """std of the law at distances [m]."""
        return np.asarray(self.floor * np.exp(self.m * np.asarray(distance, np.float64)))


def fit_points(
    distances: ArrayLike,
    stds: ArrayLike,
    counts: ArrayLike | None = None,
    *,
    floor: float | None = PAPER_FLOOR,
    tag: str = "material",
    source: str = "fit_points",
) -> MaterialFit:
    """Fit std(d) = floor·exp(m·d) (section 2 of the paper), and std = k·d² for comparison.

    distances, stds: (K,) [m]. counts: (K,) how many independent numbers are behind each std, which sets its weight;
    without it all weigh the same. floor: [m]; None to fit it too. source: what errors name.
    Raises :class:`InputError` for fewer than two different distances (three, to fit the floor), or numbers that are
    not finite and positive.
    """
    d, s = np.asarray(distances, np.float64), np.asarray(stds, np.float64)
    n = None if counts is None else np.asarray(counts, np.float64)
    if d.ndim != 1 or s.shape != d.shape or (n is not None and n.shape != d.shape):
        raise InputError(source, "", "distances, stds and counts differ in length", "give one of each a point")
    for name, values, least in (("distance", d, 0.0), ("std", s, 0.0), ("count", n, 1.0)):
        bad = np.empty(0, int) if values is None else np.flatnonzero(~(np.isfinite(values) & (values > least)))
        if values is not None and bad.size:
            raise InputError(
                source, f"point {bad[0]}", f"the {name} is {values[bad[0]]:g}", f"give one above {least:g}"
            )
    different, wanted = np.unique(d).size, 2 if floor is not None else 3
    if different < wanted:
        found = f"has {different} distance{'s' * (different != 1)}" + (f" of {tag}" if source != "fit_points" else "")
        raise InputError(source, "", found, f"record at least {wanted}, the more and farther apart the better")
    y, variance = log_std(s, n)
    law = _exponential(d, s, y, variance, floor)
    quadratic = fit_law(y, variance, 2 * np.log(d), np.ones((d.size, 1)), s)
    m, ci95 = float(law.parameters[0]), law.interval(0)
    floor_ci95 = None
    if floor is None:
        low, high = law.interval(1)
        floor, floor_ci95 = float(np.exp(law.parameters[1])), (float(np.exp(low)), float(np.exp(high)))
    span = float(d.min()), float(d.max())
    return MaterialFit(tag, m, ci95, floor, floor_ci95, d.size, span, law, quadratic)


def fit_curve(curve: Curve, *, floor: float | None = PAPER_FLOOR, spread: SpreadKind = "spatial") -> MaterialFit:
    """:func:`fit_points` on a measured curve: its std over the image (spatial) or over the frames (temporal)."""
    prefix = "" if spread == "spatial" else "temporal_"
    stds, counts = curve.column(f"{prefix}std"), curve.column(f"{prefix}count")
    if not (np.isfinite(stds) & (counts > 1)).all():
        fix = "record several frames at each distance, the camera at rest, or use the spatial std"
        raise InputError(curve.source, "", f"{curve.tag} has no temporal std at every distance", fix)
    return fit_points(curve.column("distance"), stds, counts, floor=floor, tag=curve.tag, source=curve.source)


def _exponential(d: Floats, s: Floats, y: Floats, variance: Floats, floor: float | None) -> LawFit:
    if floor is None:
        return fit_law(y, variance, np.zeros_like(d), np.stack([d, np.ones_like(d)], axis=1), s)
    return fit_law(y, variance, np.full_like(d, np.log(floor)), d[:, None], s)
