"""Open ground: a closed slab with a shaped top."""

import numpy as np
from numpy.typing import NDArray

from depthsim.procedural.part import Floats, Part
from depthsim.procedural.primitives import grid_faces


def slab(x: Floats, y: Floats, top: Floats, tags: NDArray[np.integer], names: tuple[str, ...], bottom: float) -> Part:
    """The ground over the grid of ``x`` (N,) and ``y`` (M,) [m].

    top: (M, N) heights. tags: (M - 1, N - 1, 2) indices into ``names``, one for each of a cell's two
    triangles, the one at its lower right first; sides and underside have the first name.
    """
    rows, columns = top.shape
    flat = np.stack([*np.meshgrid(x, y), top], axis=-1).reshape(-1, 3)
    index = np.arange(rows * columns).reshape(rows, columns)
    # Round the rim counter-clockwise, a skirt down to its shadow at the bottom, and a fan that closes it.
    rim = np.concatenate([index[0, :-1], index[:-1, -1], index[-1, :0:-1], index[:0:-1, 0]])
    shadow = flat[rim] * (1, 1, 0) + (0, 0, bottom)
    below = len(flat) + np.arange(len(rim))
    middle = np.array([[x.mean(), y.mean(), bottom]])
    skirt = np.stack([np.full(len(rim), below[-1] + 1), below, rim])
    skirt = np.concatenate([skirt, skirt[:, :1]], axis=1)
    surface, sides = grid_faces(index), grid_faces(skirt)
    return Part(
        np.concatenate([flat, shadow, middle]),
        np.concatenate([surface, sides]).astype(np.uint32),
        np.concatenate([tags.ravel(), np.zeros(len(sides), np.int64)]).astype(np.uint8),
        names,
    )
