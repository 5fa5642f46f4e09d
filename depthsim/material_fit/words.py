"""A fit in sentences."""

import numpy as np

from depthsim.material_fit.curve import Curve
from depthsim.material_fit.fit import DECIDED, MaterialFit

MISFIT = 0.25
"""A law that the points lie this much off, as a share of the std, is no description of them."""


def result(fit: MaterialFit) -> str:
    """m, the floor and how well the law fits, in one line."""
    m, low, high = fit.m_text
    floor = f"floor {fit.floor * 1000:.3g} mm"
    floor += " held fixed" if fit.floor_ci95 is None else " (95 %: {:.3g} to {:.3g})".format(*_mm(fit.floor_ci95))
    return (
        f"{fit.tag}: m = {m} 1/m (95 %: {low} to {high}), {floor}; R² {fit.r2:.2f}, "
        f"RMSE {fit.rmse * 1000:.3g} mm; {fit.n} distances, {fit.span[0]:.2f} to {fit.span[1]:.2f} m"
    )


def comparison(fit: MaterialFit, focal_baseline: float | None) -> str:
    """Whether the paper's law or constant disparity noise describes the points better."""
    gain = abs(fit.quadratic.aic - fit.law.aic)
    pixels = f" (disparity noise of {fit.k * focal_baseline:.3f} px)" if focal_baseline else ""
    figures = (
        f"R² {fit.law.r2:.2f} for the law and {fit.quadratic.r2:.2f} for std ∝ d²{pixels}; "
        f"the points lie {fit.law.scatter:.0%} and {fit.quadratic.scatter:.0%} off them beyond sampling error"
    )
    if min(fit.law.scatter, fit.quadratic.scatter) > MISFIT:
        return f"Neither the law nor std ∝ d² describes these points: {figures}."
    if fit.better == "undecided":
        return f"The law and std ∝ d² do equally well here (AIC apart by {gain:.1f}, below {DECIDED:g}): {figures}."
    if fit.better == "quadratic":
        return (
            f"std ∝ d² fits better than the law (AIC lower by {gain:.0f}): {figures}. "
            "Real stereo cameras do that; the effect disparity_noise then describes this camera, not m."
        )
    return f"The law fits better than std ∝ d² (AIC lower by {gain:.0f}): {figures}."


def warnings(curve: Curve, fit: MaterialFit) -> list[str]:
    """What to know before believing the figures; empty where nothing stands out."""
    found = []
    d, std, robust, bias = (curve.column(name) for name in ("distance", "std", "robust_std", "bias"))
    off = np.abs(bias) > std
    if curve.column("incidence").size and np.isfinite(curve.column("incidence")).all() and off.any():
        found.append(
            f"the mean error exceeds the std at {off.sum()} of {d.size} distances, {d[off].min():.2f} to "
            f"{d[off].max():.2f} m: scene, poses or masks do not fit there"
        )
    tails = robust < 0.8 * std
    if tails.sum() * 2 > d.size:
        found.append("the noise has heavy tails: the robust deviation is below 80 % of the std at most distances")
    if fit.span[1] * fit.law.parameters[0] < 0.7:
        found.append("over this span the law does not even double: farther distances would determine m better")
    if fit.m < 0:
        found.append(
            f"m is negative, so there is no entry: the camera is less noisy than the floor of {fit.floor * 1000:g} mm; "
            "`fit_floor`, or the effect disparity_noise, can describe it"
        )
    return found + [f"left out: {text}" for text in curve.left_out]


def _mm(interval: tuple[float, float]) -> tuple[float, float]:
    return interval[0] * 1000, interval[1] * 1000
