"""What is fitted: the residuals of all logs side by side, cut into blocks of time, with the noise of each channel."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from depthsim.flight.fit.motion import CUTOFF
from depthsim.flight.table import Floats
from depthsim.gap.config import FlightConfig
from depthsim.gap.flight.data.noise import noise_levels
from depthsim.gap.flight.data.records import ACCELEROMETER, VELOCITIES, Record, Records
from depthsim.gap.flight.data.simulate import Course, Model, Settings
from depthsim.gap.flight.effect import Candidate
from depthsim.gap.resampling import contiguous

Values = tuple[tuple[float, ...], ...]
LEAST_LOGS = 3
"""Logs from which on some are fitted, some selected and some reported on."""
TILT = 0.005
"""[rad] how well the attitude in a log is known to be the body's: 0.3 degrees."""
EVERY, FIT, SELECT, REPORT = range(4)


@dataclass(frozen=True)
class Problem:
    """Logs and a vehicle, ready for fits; n samples in all, C channels, A axes.

    measured: (n, C, A). blocks: (n,) the block of time of each sample; folds: (blocks,) when each block is held out.
    roles: (blocks,) FIT, SELECT or REPORT where there are three logs or more, each log one of them; EVERY otherwise.
    sigma: (C, A) noise [m/s²]. worth: independent samples that a kept one counts for.
    """

    records: Records
    model: Model
    base: Settings
    measured: Floats
    blocks: NDArray[np.int_]
    folds: NDArray[np.int_]
    roles: NDArray[np.int_]
    starts: NDArray[np.int_]
    sigma: Floats
    worth: float
    config: FlightConfig

    @property
    def weights(self) -> Floats:
        """(C, A)."""
        return self.worth / self.sigma**2

    @property
    def selecting(self) -> NDArray[np.bool_]:
        """(blocks,) those that causes are selected on."""
        return np.isin(self.roles, (EVERY, SELECT))

    @property
    def reporting(self) -> NDArray[np.bool_]:
        """(blocks,) those that figures are reported on."""
        return np.isin(self.roles, (EVERY, REPORT))

    def training(self, fold: int) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """(blocks,) those that a fold's prediction is fitted on: for what all logs share, and for the log's own.

        What is one log's own, such as its bias, other logs do not say: that is from the rest of the log.
        """
        held = self.folds == fold
        role = int(self.roles[held][0])
        if role == EVERY:
            return ~held, ~held
        of_block = np.concatenate([np.full(len(np.unique(b)), part.file) for part, b in self._by_part()])
        shared = self.roles == FIT if role != REPORT else self.roles != REPORT
        return shared & ~held, (of_block == of_block[held][0]) & ~held

    def _by_part(self) -> Iterator[tuple[Record, NDArray[np.int_]]]:
        """The records with the blocks of their samples."""
        at = 0
        for part in self.records.parts:
            yield part, self.blocks[at : at + len(part)]
            at += len(part)

    @cached_property
    def reported_rows(self) -> NDArray[np.bool_]:
        """(n,) samples that figures are reported on."""
        return self.reporting[self.blocks]

    @cached_property
    def reported(self) -> "Problem":
        """The logs alone that figures are reported on, each with folds of its own."""
        if self.reporting.all():
            return self
        rows = self.reported_rows
        kept = [part for part, blocks in self._by_part() if self.reporting[blocks[0]]]
        blocks = np.unique(self.blocks[rows], return_inverse=True)[1]
        folds = np.unique(self.folds[self.reporting], return_inverse=True)[1] % self.config.data.folds
        return replace(
            self,
            records=replace(self.records, parts=tuple(kept)),
            measured=self.measured[rows],
            blocks=blocks,
            folds=folds,
            roles=np.full(len(folds), EVERY),
            starts=np.flatnonzero(np.diff(blocks, prepend=-1)),
        )

    @cached_property
    def counts(self) -> NDArray[np.int_]:
        """(blocks,) samples of each."""
        return np.bincount(self.blocks)

    @cached_property
    def tilts(self) -> Floats:
        """(n, C, A, 2F) how the velocities' channel changes with the attitude's tilt about x and y in each log."""
        files = len(self.records.files) if self.measured.shape[1] > 1 else 0
        out = np.zeros((*self.measured.shape, 2 * files))
        at = 0
        for part in self.records.parts if files else ():
            rows = slice(at, at + len(part))
            upward = part.measured[1, :, 2]
            out[rows, 1, 0, 2 * part.file] = -upward
            out[rows, 1, 1, 2 * part.file + 1] = upward
            at += len(part)
        return out

    def settings(self, candidates: Sequence[Candidate], values: Values) -> Settings:
        """The base with candidates applied."""
        s = self.base
        for candidate, numbers in zip(candidates, values, strict=True):
            s = candidate.apply(s, numbers)
        return s

    def steady_course(self, wind: Sequence[float]) -> Course:
        """A wind (2,) that is the same all along."""
        spans = {part.file: np.array(part.span) for part in self.records.parts}
        return tuple((spans[file], np.tile(wind, (2, 1))) for file in sorted(spans))

    def predict(self, s: Settings) -> Floats:
        """(n, C, A)."""
        axes = list(self.records.axes)
        parts = [np.moveaxis(self.model.predict(part, s), 0, 1)[..., axes] for part in self.records.parts]
        return np.concatenate(parts)

    def noise(self, s: Settings) -> Floats:
        """(C, A) what of the residual under these settings is noise [m/s²], by its spectrum."""
        squares: Floats = np.zeros(1)
        seconds = 0.0
        for part in self.records.parts:
            inside = slice(part.rows[0], part.rows[-1] + 1)
            raw = [
                (seen - expected)[inside]
                for seen, expected in zip(part.raw, self.model.unfiltered(part, s), strict=True)
            ]
            levels = np.stack([noise_levels(channel, part.rate) for channel in raw])
            squares = squares + part.seconds * levels**2
            seconds += part.seconds
        return np.asarray(np.sqrt(squares / seconds))[:, list(self.records.axes)]


def make_problem(records: Records, model: Model, base: Settings, config: FlightConfig) -> Problem:
    """Lay the blocks and find the noise."""
    axes = list(records.axes)
    measured = np.concatenate([np.moveaxis(part.measured, 0, 1)[..., axes] for part in records.parts])
    blocks: list[NDArray[np.int_]] = []
    folds: list[NDArray[np.int_]] = []
    roles: list[NDArray[np.int_]] = []
    apart = len({part.file for part in records.parts}) >= LEAST_LOGS
    for number, part in enumerate(records.parts):
        count = max(round(part.seconds / config.data.block), 2)
        blocks.append(contiguous(len(part), count) + sum(len(fold) for fold in folds))
        folds.append(contiguous(count, config.data.folds) + (number * config.data.folds if apart else 0))
        roles.append(np.full(count, (FIT, SELECT, REPORT)[part.file % 3] if apart else EVERY))
    rows = np.concatenate(blocks)
    starts = np.flatnonzero(np.diff(rows, prepend=-1))
    worth = min(1.0, 2 * CUTOFF * records.parts[0].step)
    shape = measured.shape[1:]
    held = np.unique(np.concatenate(folds), return_inverse=True)[1]
    problem = Problem(
        records, model, base, measured, rows, held, np.concatenate(roles), starts, np.ones(shape), worth, config
    )
    return with_noise(problem, base)


def with_noise(problem: Problem, s: Settings) -> Problem:
    """The same problem with the noise as the residual under ``s`` has it."""
    data = problem.config.data
    trusted = {ACCELEROMETER: data.least_noise_accelerometer, VELOCITIES: data.least_noise_velocities}
    least = np.array([trusted[channel] for channel in problem.records.channels])[:, None]
    sigma = np.sqrt(problem.noise(s) ** 2 + least**2)
    if len(sigma) > 1:
        sigma[1] = np.maximum(sigma[1], _mismatch(problem, sigma[0]))
    return replace(problem, sigma=sigma)


def _mismatch(problem: Problem, noise: Floats) -> Floats:
    """(A,) what accelerometer and velocities differ by [m/s²], beyond what a bias, a rotation or a delay explains.

    It is held against the velocities: filters and slow errors of a motion capture are not noise by their spectrum.
    """
    one, other = problem.measured[:, 0], problem.measured[:, 1]
    squares, samples = np.zeros(one.shape[1]), 0
    at = 0
    for part in problem.records.parts:
        rows = slice(at, at + len(part))
        force = part.measured[1]
        columns = np.column_stack([np.ones(len(part)), force, np.gradient(force, axis=0)])
        difference = one[rows] - other[rows]
        left = difference - columns @ np.linalg.lstsq(columns, difference, rcond=None)[0]
        squares, samples = squares + (left**2).sum(axis=0), samples + len(part)
        at += len(part)
    return np.asarray(np.sqrt(np.maximum(squares / samples - noise**2, 0)))
