"""The part that all effects share which lose returns at random."""

import numpy as np

from depthsim.draws import uniform_block
from depthsim.kernels import inlined

_ZERO = np.float32(0)


@inlined
def lose(block, frame, key, chance, words, uniforms, depth):  # noqa: ANN201 - numba
    """Set each depth of block ``block`` to 0 with its own chance.

    chance: (256,) float32; at 0 or below a depth is safe, at 1 or above it becomes a hole. words: (256,) uint32 and
    uniforms: (256,) float32 are scratch. depth: at most 256 float32, changed.
    """
    some = np.int32(0)
    for i in range(depth.size):
        some |= np.int32(chance[i] > _ZERO)
    # A block that can have no holes, which are most of them, needs no numbers: they are counted, not used up.
    if some:
        uniform_block(block, frame, 0, key, words, uniforms)
        for i in range(depth.size):
            depth[i] = depth[i] if uniforms[i] >= chance[i] else _ZERO
