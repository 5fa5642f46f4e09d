"""Solids made of boxes with their faces along the axes: rooms with recesses, furniture, frames."""

from typing import NamedTuple

import numpy as np

from depthsim.procedural.part import Part

Range = tuple[float, float]


class Block(NamedTuple):
    """One box: its tag, or None where it cuts a hole, and its range along each axis [m]."""

    tag: str | None
    x: Range
    y: Range
    z: Range

    @property
    def ranges(self) -> tuple[Range, Range, Range]:
        """Its range along x, y and z [m]."""
        return self.x, self.y, self.z


def blocks(*items: Block, around: str | None = None) -> Part:
    """The surface of several boxes as one watertight mesh; a later box replaces what earlier ones put there.

    There are no faces inside, and no two faces lie on one another. With ``around`` all of space is solid and has that
    tag to begin with, so that cut holes become rooms: their faces look inward, and nothing is seen from outside.
    """
    tags = list(dict.fromkeys([tag for tag in (around, *(item.tag for item in items)) if tag is not None]))
    edges = []
    for axis in range(3):
        cuts = np.unique(np.round([end for item in items for end in item.ranges[axis]], 6))
        edges.append(np.concatenate([[cuts[0] - 1], cuts, [cuts[-1] + 1]]))
    void = len(tags)
    cells = np.full([len(cuts) - 1 for cuts in edges], 0 if around else void)
    for item in items:
        inside = tuple(slice(*np.searchsorted(cuts, np.round(item.ranges[axis], 6))) for axis, cuts in enumerate(edges))
        cells[inside] = void if item.tag is None else tags.index(item.tag)

    quads, quad_tags = [], []
    for axis in range(3):
        # The axis first, then the other two in cyclic order: the quad's corners then turn about +axis.
        turned = np.moveaxis(cells, [axis, (axis + 1) % 3, (axis + 2) % 3], [0, 1, 2])
        low, high = turned[:-1], turned[1:]
        for here, there, order in ((low, high, [0, 1, 2, 3]), (high, low, [3, 2, 1, 0])):
            i, j, k = np.nonzero((here != void) & (there == void))
            corners = np.stack([[i + 1, j + b, k + c] for b, c in ((0, 0), (1, 0), (1, 1), (0, 1))])
            quads.append(np.roll(corners, axis, axis=1)[order].transpose(2, 0, 1))
            quad_tags.append(here[i, j, k])
    lattice = np.concatenate(quads)
    indices = np.ravel_multi_index(tuple(np.moveaxis(lattice, -1, 0)), [len(cuts) for cuts in edges])
    used, inverse = np.unique(indices, return_inverse=True)
    inverse = inverse.reshape(-1, 4)
    places = np.unravel_index(used, [len(cuts) for cuts in edges])
    return Part(
        np.stack([cuts[place] for cuts, place in zip(edges, places, strict=True)], axis=1),
        inverse[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3).astype(np.uint32),
        np.repeat(np.concatenate(quad_tags), 2).astype(np.uint8),
        tuple(tags),
    )
