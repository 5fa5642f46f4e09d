"""The ground of the forest scene: its heights, its materials, and the track that leads through it."""

import numpy as np

from depthsim.procedural.ground import slab
from depthsim.procedural.noise import fractal, smooth
from depthsim.procedural.part import Floats, Part

PATH = np.array(
    [
        (-19.0, -6.6), (-14.0, -5.0), (-9.0, -3.8), (-3.6, -2.8), (0.8, -0.6),
        (2.8, 3.6), (2.4, 8.6), (4.0, 13.6), (8.5, 18.6), (15.0, 24.0),
    ]
)  # fmt: skip
"""The middle line of the track [m]; the forest scene's trajectory follows it."""
HALF_X, LOW_Y, HIGH_Y = 27.0, -17.0, 23.0


class Land:
    """The lie of the land for one seed."""

    def __init__(self, seed: int) -> None:
        self.seed = seed

    def height(self, x: Floats, y: Floats) -> Floats:
        """Height of the ground at points (N,) [m]: rolling, rising into the forest, flat and rutted on the track."""
        points = np.column_stack([x, y, np.zeros(len(x))])
        rolling = 0.55 * smooth(points / 13.0, self.seed) + 0.045 * np.clip(y, -4, None)
        bumps = 0.11 * fractal(smooth, points / 2.2, self.seed + 1, 3)
        off = to_track(x, y)
        ruts = -0.07 * np.exp(-(((off - 0.75) / 0.2) ** 2))
        return np.asarray(rolling + bumps * np.clip((off - 0.4) / 1.5, 0.15, 1) + ruts)

    def place(self, x: Floats, y: Floats, sink: float = 0.0) -> Floats:
        """(N, 3) points on the ground, or ``sink`` below it."""
        return np.column_stack([x, y, self.height(x, y) - sink])

    def ground(self) -> Part:
        """The ground itself: grass, leaf litter from the edge on, soil on the track."""
        # A finer grid where the track and the edge are.
        x = np.concatenate(
            [np.linspace(-HALF_X, -17, 24)[:-1], np.linspace(-17, 8, 126)[:-1], np.linspace(8, HALF_X, 42)]
        )
        y = np.concatenate([np.linspace(LOW_Y, -8, 20)[:-1], np.linspace(-8, 5, 74)[:-1], np.linspace(5, HIGH_Y, 46)])
        grid_x, grid_y = (grid.ravel() for grid in np.meshgrid(x, y))
        top = self.height(grid_x, grid_y).reshape(len(y), len(x))
        thirds = np.array([2 / 3, 1 / 3])
        cell_x = np.repeat((x[:-1, None] + np.diff(x)[:, None] * thirds)[None], len(y) - 1, axis=0).ravel()
        cell_y = np.repeat((y[:-1, None] + np.diff(y)[:, None] * thirds[::-1])[:, None], len(x) - 1, axis=1).ravel()
        ragged = fractal(smooth, np.column_stack([cell_x, cell_y, 0 * cell_x]) / 1.7, self.seed + 9, 3)
        tags = np.where(cell_y + 1.2 * ragged > 0.3, 1, 0)
        tags[to_track(cell_x, cell_y) + 0.35 * ragged < 1.25] = 2
        names = ("grass", "leaf_litter", "soil")
        return slab(x, y, top, tags.reshape(len(y) - 1, len(x) - 1, 2), names, -3.0)


def to_track(x: Floats, y: Floats) -> Floats:
    """How far points (N,) are from the middle of the track [m]."""
    points = np.column_stack([x, y])
    start, end = PATH[:-1], PATH[1:]
    along = end - start
    share = np.einsum("nsi,si->ns", points[:, None] - start, along) / (along**2).sum(axis=1)
    nearest = start + np.clip(share, 0, 1)[..., None] * along
    return np.asarray(np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1))
