"""What comes and goes in time: a force, or a wind, as straight lines between knots, validated by interpolation.

Gusts cannot be predicted from one stretch of time for another, but they last: what is seen before and after a short
piece says what was in it. So pieces are left out in turn and filled in from their neighbours.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.drag import LINEAR, ROTOR_SQRT
from depthsim.flight.table import Floats
from depthsim.gap.flight.data.evidence import Problem
from depthsim.gap.flight.data.records import Record
from depthsim.gap.flight.data.simulate import Course, Settings

_KNOTS = 0.4
"""[s] between knots."""
_PIECE = 0.5
"""[s] that are left out at once."""
_TURNS = 4
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
    over both channels."""

    predicted: Floats
    knots: Floats
    time: Floats
    files: NDArray[np.int_]
    gains: Floats

    @property
    def course(self) -> Course:
        """Stamps and values of each log, as the settings have them."""
        return tuple(
            (self.time[self.files == file], self.knots[self.files == file]) for file in range(self.files.max() + 1)
        )


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

    def solve(self, which: NDArray[np.bool_], stiff: float) -> Floats:
        """(k, D) knots from the samples of some turns."""
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
        vector = self.vectors[which].sum(axis=0).ravel()
        return np.asarray(solveh_banded(band, vector, lower=True).reshape(count, width))

    def knots(self, stiff: float) -> Floats:
        """(k, D) from everything."""
        return self.solve(np.ones(_TURNS, dtype=bool), stiff)

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
    places = max(int(np.ceil(time[-1] / _KNOTS)) + 1, 2)
    at = time / _KNOTS
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
    times = record.log.t[record.rows[0]] + np.arange(places) * _KNOTS
    return _Part(flat, flat_r, left, share, turns, inner, outer, vectors, times, r.shape)
