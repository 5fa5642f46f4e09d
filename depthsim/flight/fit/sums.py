"""Least squares from sums over blocks of time.

A flight's force along an axis is ``y = X θ + n z + noise``: the coefficients θ belong to all flights, the nuisance n
to one flight and one axis (z = 1: an offset of the accelerometer; z = thrust: its scale). All that a fit, a bootstrap
and a held-out error need are sums of products, so each block of time is summed once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.table import Floats

BLOCK = 2.5
"""[s]; the residuals of real flights are correlated over about a second, within a block that does no harm."""
DRAWS = 1000


@dataclass(frozen=True)
class Sums:
    """Sums of products, leading axes: blocks or flights, then the axes of the body (A); P coefficients.

    n: (.., A) samples. zz, zy, yy: (.., A). zx, xy: (.., A, P). xx: (.., A, P, P).
    """

    n: Floats
    zz: Floats
    zy: Floats
    yy: Floats
    zx: Floats
    xy: Floats
    xx: Floats

    @staticmethod
    def of_blocks(y: Floats, x: Floats, z: Floats, rate: float) -> "Sums":
        """Block sums of one flight. y: (n, A). x: (n, A, P). z: (n, A)."""
        count = max(round(len(y) / rate / BLOCK), 2)
        begins = (np.arange(count) * len(y)) // count

        def total(values: Floats) -> Floats:
            return np.asarray(np.add.reduceat(values, begins, axis=0))

        return Sums(
            total(np.ones_like(y)),
            total(z * z),
            total(z * y),
            total(y * y),
            total(z[..., None] * x),
            total(x * y[..., None]),
            total(x[..., :, None] * x[..., None, :]),
        )

    def __len__(self) -> int:
        return len(self.n)

    def __getitem__(self, key: slice | NDArray) -> "Sums":
        return Sums(*(getattr(self, field.name)[key] for field in fields(self)))

    def total(self) -> "Sums":
        """Over the blocks."""
        return Sums(*(getattr(self, field.name).sum(axis=0) for field in fields(self)))

    def weighted(self, weights: Floats) -> "Sums":
        """Over the blocks, each with its weight; weights (R, blocks) give a leading axis R."""
        return Sums(*(np.tensordot(weights, getattr(self, field.name), axes=1) for field in fields(self)))

    @staticmethod
    def stacked(parts: "Sequence[Sums]", axis: int = 0) -> "Sums":
        """Sums side by side along a new axis."""
        return Sums(*(np.stack([getattr(part, field.name) for part in parts], axis) for field in fields(Sums)))

    def normal(self) -> tuple[Floats, Floats]:
        """Normal equations (.., A, P, P) and (.., A, P) with the nuisance taken out."""
        share = self.zx / self.zz[..., None]
        matrix = self.xx - share[..., :, None] * self.zx[..., None, :]
        return matrix, self.xy - share * self.zy[..., None]

    def nuisance(self, theta: Floats) -> Floats:
        """(.., A) the best nuisance for given coefficients (P,)."""
        return np.asarray((self.zy - self.zx @ theta) / self.zz)

    def squares(self, theta: Floats, nuisance: Floats) -> Floats:
        """(.., A) sums of squared residuals."""
        n = nuisance
        cross = 2 * n * (self.zx @ theta - self.zy) - 2 * self.xy @ theta
        return np.asarray(np.maximum(self.yy + self.xx @ theta @ theta + n * n * self.zz + cross, 0.0))


def solve(flights: Sums) -> Floats:
    """(.., P) the coefficients from flight sums (.., flights, A, P); what the flights do not determine is 0."""
    matrix, vector = flights.normal()
    matrix, vector = matrix.sum(axis=(-4, -3)), vector.sum(axis=(-3, -2))
    scale = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), 1e-300))
    inverse = np.linalg.pinv(matrix / (scale[..., :, None] * scale[..., None, :]), rcond=1e-10, hermitian=True)
    return np.asarray((inverse @ (vector / scale)[..., None])[..., 0] / scale)


def identified(flights: Sums) -> bool:
    """Whether the flights determine every coefficient."""
    matrix = flights.normal()[0].sum(axis=(-4, -3))
    scale = np.sqrt(np.diagonal(matrix))
    size = np.sqrt(np.diagonal(flights.xx.sum(axis=(-4, -3))))
    if not (scale > 1e-6 * np.maximum(size, 1e-300)).all():
        return False
    return bool(np.linalg.cond(matrix / np.outer(scale, scale)) < 1e8)


def interval95(flights: Sequence[Sums]) -> tuple[Floats, Floats]:
    """95 % intervals (P,) low and high, by bootstrap over blocks of time and, from five flights on, over flights.

    ``flights``: the block sums of each. Blocks are drawn within their flight; flights are drawn whole, which sees what
    differs from flight to flight. Of the two standard errors the larger one counts, with Student's factor for the
    number of units that were drawn: from few units a percentile interval is too narrow.
    """
    from scipy.special import stdtrit

    generator = np.random.Generator(np.random.Philox(key=0))
    theta = solve(Sums.stacked([flight.total() for flight in flights]))
    drawn = []
    for flight in flights:
        units = len(flight)
        weights = generator.multinomial(units, np.full(units, 1 / units), size=DRAWS).astype(float)
        drawn.append(flight.weighted(weights))
    blocks = sum(map(len, flights))
    free = blocks - len(flights)
    spread = _spread(Sums.stacked(drawn, axis=1)) * np.sqrt(blocks / free)
    half = stdtrit(free, 0.975) * spread
    if len(flights) >= 5:
        units = len(flights)
        picks = generator.integers(units, size=(DRAWS, units))
        whole = Sums.stacked([flight.total() for flight in flights])
        spread = _spread(whole[picks])
        half = np.maximum(half, stdtrit(units - 1, 0.975) * spread * np.sqrt(units / (units - 1)))
    return theta - half, theta + half


def _spread(draws: Sums) -> Floats:
    """The standard deviation of the coefficients over the draws; a draw that determines none of them is left out."""
    matrix = draws.normal()[0].sum(axis=(-4, -3))
    scale = np.sqrt(np.maximum(np.diagonal(matrix, axis1=-2, axis2=-1), 1e-300))
    well = np.linalg.cond(matrix / (scale[:, :, None] * scale[:, None, :])) < 1e10
    return np.asarray(solve(draws[well]).std(axis=0, ddof=1))
