"""Colours of materials and of depths."""

import numpy as np
from numpy.typing import NDArray

from depthsim.materials import Materials
from depthsim.runs.terminal import turbo


def material_colours(tags: tuple[str, ...], materials: Materials) -> NDArray[np.uint8]:
    """(256, 3) RGB of the tags' indices, from materials.yaml; white for the index of no tag."""
    table = np.full((256, 3), 255, np.uint8)
    for index, tag in enumerate(tags):
        table[index] = list(bytes.fromhex(materials[tag].color[1:]))
    return table


def depth_colours(depth: NDArray[np.float32], near: float, far: float) -> NDArray[np.uint8]:
    """RGB with a last axis of 3, turbo from ``near`` to ``far`` [m], logarithmic; black where there is no return."""
    share = np.log(np.clip(depth, near, far) / near) / max(np.log(far / near), 1e-6)
    return np.where((depth > 0)[..., None], turbo(share), np.uint8(0)).astype(np.uint8)
