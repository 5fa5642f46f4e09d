"""What comes and goes in time: a force, or a wind, as straight lines between knots, validated by interpolation.

Gusts cannot be predicted from one stretch of time for another, but they last: what is seen before and after a short
piece says what was in it. So pieces are left out in turn and filled in from their neighbours.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.drag import LINEAR, ROTOR_SQRT
from depthsim.flight.table import Floats
from depthsim.gap.flight.data.evidence import TILT, Problem
from depthsim.gap.flight.data.records import Record
from depthsim.gap.flight.data.simulate import Course, Settings

KNOTS = 0.4
"""[s] between knots."""
_PIECE = 0.5
"""[s] that are left out at once."""
_TURNS = 4
_DRAWS = 400
"""Of the knots, for intervals."""
_ROUNDS = 3
"""Times that a wind is sought by a drag that is not linear."""
_SAME = 0.1
"""[m/s]"""
_NO_DRAG = 1e-4
"""[1/s] drag over mass and speed: less carries no wind."""
_STIFF = (0.03, 0.3, 3.0, 30.0)
"""How strongly neighbours are held together, over the mean information of a knot."""


@dataclass(frozen=True)
class Series:
    """A series in time. predicted: (n, C, A) force, each piece from its neighbours. knots: (k, D) values at all knots
    of all records, fitted to everything; time: (k,) [s]; files: (k,) the log of each. gains: (B,) of the weighed loss
    over both channels. parts, stiff: what the knots are from."""

    predicted: Floats
    knots: Floats
    time: Floats
    files: NDArray[np.int_]
    gains: Floats
    parts: "Sequence[_Part]"
    stiff: float

    @property
    def course(self) -> Course:
        """Stamps and values of each log, as the settings have them."""
        return tuple(
            (self.time[self.files == file], self.knots[self.files == file]) for file in range(self.files.max() + 1)
        )

    def draws(self, problem: Problem, seed: int = 0) -> Floats:
        """(draws, k, D) the knots again, what is left when a piece is filled in being turned about, or not, by blocks.

        So what goes together within a block of time stays together. The attitude's tilts are found anew beside the
        knots. Source: Liu, "Bootstrap Procedures under Some Non-i.i.d. Models", 1988.
        """
        generator = np.random.Generator(np.random.Philox(key=[seed, 0xB10C]))
        tilts, prior = np.sqrt(problem.weights)[..., None] * problem.tilts, 1 / TILT**2
        found, at = [], 0
        for part in self.parts:
            rows = slice(at, at + len(part.r))
            own = tilts[rows].reshape(*part.r.shape, -1)
            found.append(part.drawn(self.stiff, own, prior, problem.config.data.block, generator))
            at += len(part.r)
        return np.concatenate(found, axis=1)


def free_series(problem: Problem, residual: Floats) -> Series:
    """Any force in the body. residual: (n, A) of the first channel."""
    axes = residual.shape[1]
    columns = np.broadcast_to(np.eye(axes), (len(residual), axes, axes))[:, None]
    return _series(problem, residual[:, None], columns, problem.weights[:1])


def wind_series(problem: Problem, left: Floats, s: Settings, start: Course = ()) -> Series | None:
    """A level wind that changes. left: (n, C, A) what the settings leave without it. None where no drag carries it.

    Where drag is not linear in the airspeed, the force of a wind is taken straight about the wind found before; start:
    about which it is at first.
    """
    base = problem.predict(s)
    found: Series | None = None
    for _ in range(1 if _is_linear(s) else _ROUNDS):
        about = replace(s, course=start)
        columns = _wind_columns(problem, about)
        if np.abs(columns).max() < _NO_DRAG:
            return None
        along = np.einsum("ncad,nd->nca", columns, _at_samples(problem, start))
        beside = problem.predict(about) - base - along
        before, found = found, _series(problem, left - beside, columns, problem.weights)
        force = beside + found.predicted
        gains = ((left**2 - (left - force) ** 2) * problem.weights).sum(axis=(1, 2))
        found = replace(found, predicted=force, gains=np.add.reduceat(gains, problem.starts))
        start = found.course
        if before is not None and np.abs(found.knots - before.knots).max() < _SAME:
            break
    return found


def _is_linear(s: Settings) -> bool:
    """Whether the force of a wind is in proportion to it."""
    return all(code in (LINEAR, ROTOR_SQRT) for code, _ in s.laws.values())


def _at_samples(problem: Problem, course: Course) -> Floats:
    """(n, 2) the course at all samples."""
    found = []
    for part in problem.records.parts:
        time, knots = course[part.file] if course else (np.zeros(1), np.zeros((1, 2)))
        found.append(np.column_stack([np.interp(part.log.t[part.rows], time, column) for column in knots.T]))
    return np.concatenate(found)


def _wind_columns(problem: Problem, s: Settings) -> Floats:
    """(n, C, A, 2) force for 1 m/s more of wind along x and y of the world."""
    base = problem.predict(s)
    found = []
    for axis in range(2):
        wind = list(s.wind)
        wind[axis] += 0.5
        found.append((problem.predict(replace(s, wind=(wind[0], wind[1], wind[2]))) - base) / 0.5)
    return np.stack(found, axis=-1)


def _series(problem: Problem, residual: Floats, columns: Floats, weights: Floats) -> Series:
    root = np.sqrt(weights)
    at = 0
    parts = []
    for record in problem.records.parts:
        rows = slice(at, at + len(record))
        parts.append(_prepared(record, root * residual[rows], root[..., None] * columns[rows]))
        at += len(record)
    losses = []
    fills = []
    for stiff in _STIFF:
        filled = np.concatenate([part.filled(stiff) for part in parts])
        fills.append(filled)
        losses.append(float(((root * residual - filled) ** 2).sum()))
    best = int(np.argmin(losses))
    gains = (root * residual) ** 2 - (root * residual - fills[best]) ** 2
    knots = [part.knots(_STIFF[best]) for part in parts]
    return Series(
        predicted=fills[best] / root,
        knots=np.concatenate(knots),
        time=np.concatenate([part.times for part in parts]),
        files=np.concatenate(
            [np.full(len(one), record.file) for one, record in zip(knots, problem.records.parts, strict=True)]
        ),
        gains=np.add.reduceat(gains.sum(axis=(1, 2)), problem.starts),
        parts=parts,
        stiff=_STIFF[best],
    )


@dataclass(frozen=True)
class _Part:
    """One record. x: (n, CA, D) columns; r: (n, CA). left, share: the hats of a sample. For each turn's samples the
    block-tridiagonal normal equations over the k knots: inner (k, D, D), outer (k - 1, D, D), vector (k, D)."""

    x: Floats
    r: Floats
    left: NDArray[np.int_]
    share: Floats
    turns: NDArray[np.int_]
    inner: Floats
    outer: Floats
    vectors: Floats
    times: Floats
    shape: tuple[int, ...]

    def solve(self, which: NDArray[np.bool_], stiff: float, vectors: Floats | None = None) -> Floats:
        """(k, D) knots from the samples of some turns; or (k, D, draws) from other right-hand sides."""
        from scipy.linalg import solveh_banded

        count, width = self.vectors.shape[1:]
        held = stiff * max(np.einsum("tkdd->", self.inner) / (count * width), 1e-12)
        same, next_ = self.inner[which].sum(axis=0), self.outer[which].sum(axis=0)
        band = np.zeros((2 * width, count * width))
        neighbours = np.full(count, 2.0)
        neighbours[[0, -1]] = 1.0
        for d in range(width):
            for e in range(d + 1):
                band[d - e, e::width] = same[:, d, e]
            for e in range(width):
                # Row (k + 1, d), column (k, e): in a lower band it stands width + d - e below the diagonal.
                if width + d - e < 2 * width:
                    band[width + d - e, e : (count - 1) * width : width] = next_[:, e, d]
            band[0, d::width] += held * (neighbours + 1e-6)
            band[width, d : (count - 1) * width : width] -= held
        vector = self.vectors[which].sum(axis=0) if vectors is None else vectors
        solved = solveh_banded(band, vector.reshape(count * width, *vector.shape[2:]), lower=True)
        return np.asarray(solved.reshape(vector.shape))

    def knots(self, stiff: float) -> Floats:
        """(k, D) from everything."""
        return self.solve(np.ones(_TURNS, dtype=bool), stiff)

    def drawn(
        self, stiff: float, tilts: Floats, prior: float, seconds: float, generator: np.random.Generator
    ) -> Floats:
        """(draws, k, D) knots, see :meth:`Series.draws`. tilts: (n, CA, T) weighed columns, each known by a prior."""
        left = self.r - self.filled(stiff).reshape(self.r.shape)
        blocks = ((self.times[self.left] - self.times[0]) / seconds).astype(int)
        starts = np.flatnonzero(np.diff(blocks, prepend=-1))
        pulls = self._on_knots(left[..., None] * np.eye(len(starts))[blocks][:, None])  # (k, D, blocks)
        turns = np.add.reduceat(np.einsum("nat,na->nt", tilts, left), starts)
        signs = generator.choice([-1.0, 1.0], size=(len(starts), _DRAWS))
        every = np.ones(_TURNS, dtype=bool)
        shared = self._on_knots(tilts)
        moved, by_tilts = self.solve(every, stiff, pulls @ signs), self.solve(every, stiff, shared)
        inner = np.einsum("nat,nau->tu", tilts, tilts) - np.einsum("kdt,kdu->tu", shared, by_tilts)
        tilted = np.linalg.solve(
            inner + prior * np.eye(len(inner)), turns.T @ signs - np.einsum("kdt,kds->ts", shared, moved)
        )
        return self.solve(every, stiff)[None] + np.moveaxis(moved - by_tilts @ tilted, -1, 0)

    def _on_knots(self, columns: Floats) -> Floats:
        """(k, D, P) how columns (n, CA, P) go with each knot."""
        along = np.einsum("nad,nap->ndp", self.x, columns)
        found = np.zeros((*self.vectors.shape[1:], columns.shape[-1]))
        for knots, weight in ((self.left, 1 - self.share), (self.left + 1, self.share)):
            np.add.at(found, knots, weight[:, None, None] * along)
        return found

    def filled(self, stiff: float) -> Floats:
        """(n, C, A) weighed force, each piece from the others."""
        out = np.empty_like(self.r)
        for turn in range(_TURNS):
            rows = self.turns == turn
            knots = self.solve(np.arange(_TURNS) != turn, stiff)
            left, share = self.left[rows], self.share[rows, None]
            values = (1 - share) * knots[left] + share * knots[left + 1]
            out[rows] = np.einsum("nad,nd->na", self.x[rows], values)
        return out.reshape(self.shape)


def _prepared(record: Record, r: Floats, x: Floats) -> _Part:
    count, width = len(record), x.shape[-1]
    time = np.arange(count) * record.step
    places = max(int(np.ceil(time[-1] / KNOTS)) + 1, 2)
    at = time / KNOTS
    left = np.minimum(at.astype(int), places - 2)
    share = at - left
    turns = (time / _PIECE).astype(int) % _TURNS
    flat, flat_r = x.reshape(count, -1, width), r.reshape(count, -1)
    products = np.einsum("nad,nae->nde", flat, flat)
    along = np.einsum("nad,na->nd", flat, flat_r)
    inner = np.zeros((_TURNS, places, width, width))
    outer = np.zeros((_TURNS, places - 1, width, width))
    vectors = np.zeros((_TURNS, places, width))
    one = 1 - share
    for place, weight in ((left, one), (left + 1, share)):
        np.add.at(vectors, (turns, place), weight[:, None] * along)
        np.add.at(inner, (turns, place), (weight**2)[:, None, None] * products)
    np.add.at(outer, (turns, left), (one * share)[:, None, None] * products)
    times = record.log.t[record.rows[0]] + np.arange(places) * KNOTS
    return _Part(flat, flat_r, left, share, turns, inner, outer, vectors, times, r.shape)
