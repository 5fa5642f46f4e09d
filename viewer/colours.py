"""Colours of materials, depths, errors, shares, and of what is there or missing."""

import numpy as np
from numpy.typing import NDArray

from depthsim.materials import Materials
from depthsim.runs.terminal import turbo

Palette = NDArray[np.uint8]
"""(256, 3) RGB."""

FATES = ("nothing there", "valid", "hole", "too far")
"""What became of a pixel: no surface there, a return, none although there is a surface, too far for 16 bits."""


def _ramp(*stops: str) -> Palette:
    """256 colours along evenly spaced stops."""
    knots = np.array([list(bytes.fromhex(stop)) for stop in stops], np.float64)
    place, at = np.linspace(0, 1, 256), np.linspace(0, 1, len(knots))
    return np.rint(np.stack([np.interp(place, at, channel) for channel in knots.T], axis=1)).astype(np.uint8)


DEPTH: Palette = turbo(np.linspace(0, 1, 256))
ERROR: Palette = _ramp("08519c", "3182bd", "6baed6", "bdd7e7", "f2f2f2", "fcbba1", "fb6a4a", "de2d26", "a50f15")
"""Blue is measured too near, red too far, and near white is right."""
SHARE: Palette = _ramp("46505f", "6b5f8a", "b5578f", "f0655f", "fba03f", "fdee7a")
"""From slate, where there is no gap, to yellow, where most of it is."""
FATE: Palette = np.zeros((256, 3), np.uint8)
FATE[:4] = [[28, 30, 36], [56, 178, 158], [240, 82, 92], [160, 110, 230]]


def material_colours(tags: tuple[str, ...], materials: Materials) -> Palette:
    """RGB of the tags' indices, from materials.yaml; white for the index of no tag, and for tags that are not there."""
    table = np.full((256, 3), 255, np.uint8)
    for index, tag in enumerate(tags):
        if tag in materials:
            table[index] = list(bytes.fromhex(materials[tag].color[1:]))
    return table


def hex_colour(rgb: NDArray[np.uint8]) -> str:
    """``#rrggbb`` of one colour."""
    return "#" + bytes(int(channel) for channel in rgb).hex()
