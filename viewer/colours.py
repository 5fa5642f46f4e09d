"""Colours of tags and of depths."""

import numpy as np
from numpy.typing import NDArray

_TAGS = np.array(
    [
        (164, 160, 150), (196, 142, 92), (92, 132, 176), (120, 164, 104), (176, 104, 112), (148, 120, 176),
        (204, 184, 104), (104, 172, 172), (140, 116, 92), (208, 152, 176), (112, 124, 92), (92, 100, 124),
    ],
    np.uint8,
)  # fmt: skip


def tag_colours(face_tags: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(N, 3) RGB, one muted colour a tag; after twelve tags they come again."""
    return _TAGS[face_tags % len(_TAGS)]


def depth_colours(depth: NDArray[np.float32], near: float, far: float) -> NDArray[np.uint8]:
    """RGB with a last axis of 3, turbo from ``near`` to ``far`` [m]; black where there is no return."""
    from matplotlib import colormaps

    table = (colormaps["turbo"](np.linspace(0.05, 0.95, 256))[:, :3] * 255).astype(np.uint8)
    place = np.clip((depth - near) / max(far - near, 1e-6) * 255, 0, 255).astype(np.uint8)
    return np.where((depth > 0)[..., None], table[place], np.uint8(0))
