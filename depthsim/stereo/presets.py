"""The presets of the D400s, and what their thresholds are here.

A preset sets the chip's own tests (``STDepthControlGroup`` of librealsense's advanced mode); the numbers are published
in librealsense, src/ds/advanced_mode/presets.cpp, the units are not. What each test does is said of its older sister in
librealsense 1 (options of the R200's depth control). Default's thresholds here were found on real pairs with the
chip's depth; the other presets' follow from the chip's numbers, in proportion.
"""

from typing import Literal, NamedTuple

Name = Literal["default", "high_accuracy", "high_density", "medium_density"]


class DepthControl(NamedTuple):
    """The chip's numbers that differ between presets; textureCountThreshold is 0, off, in all of them."""

    plus_increment: int
    minus_decrement: int
    median_threshold: int
    second_peak_threshold: int
    neighbor_threshold: int
    lr_agree_threshold: int
    difference_threshold: float
    """[px] Of STRsm."""


CHIP: dict[Name, DepthControl] = {
    "default": DepthControl(10, 10, 500, 325, 7, 24, 4.0),
    "high_accuracy": DepthControl(2, 25, 796, 647, 108, 10, 1.65625),
    "high_density": DepthControl(21, 6, 789, 222, 12, 18, 1.21875),
    "medium_density": DepthControl(3, 23, 1021, 600, 97, 19, 1.8125),
}


def thresholds(name: Name) -> dict[str, float]:
    """The matcher's settings that a preset stands for."""
    chip, default = CHIP[name], CHIP["default"]
    return {
        "second_peak": round(0.22 * chip.second_peak_threshold / default.second_peak_threshold, 3),
        # In 16ths of a pixel: disparities are compared whole, so that all but High Accuracy may differ by one.
        "left_right": round(chip.lr_agree_threshold / 16, 3),
        "neighbours": round(0.5 + 0.0015 * (chip.neighbor_threshold - default.neighbor_threshold), 3),
        "median": round(0.2 * chip.median_threshold / default.median_threshold, 3),
        "smoothing_step": chip.difference_threshold,
        # What goes up by one number where it is too low and down by another where too high rests at this quantile.
        "quantile": round(chip.plus_increment / (chip.plus_increment + chip.minus_decrement), 3),
    }
