"""How a diagnosis does on flights that had no part in it."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from depthsim.flight.log import FlightLog
from depthsim.gap.flight.data.records import prepare
from depthsim.gap.flight.findings import Findings

_START = 5.0
"""[s] in the air on which a flight's own bias may be found; these then do not count."""


def lateral_errors(found: Findings, logs: Sequence[FlightLog]) -> tuple[float, float, float]:
    """RMS of the lateral specific force [m/s²] on other flights of the vehicle, per axis.

    Before the causes were added, and after, with the accelerometer's bias of each flight taken out, since a bias
    belongs to one flight: found on all of it, or on its first 5 s in the air, and what follows counts.
    """
    problem, fit = found.problem, found.selection.fit
    settings = replace(fit.settings, bias=())
    squares, counts = np.zeros(3), np.zeros(3)
    for log in logs:
        records = prepare([log], problem.model.vehicle, problem.config)
        for record in records.parts:
            base = (record.measured - problem.model.predict(record, problem.base))[0, :, :2]
            left = (record.measured - problem.model.predict(record, settings))[0, :, :2]
            head = max(int(_START / record.step), 1)
            parts = (base, left - left.mean(axis=0), (left - left[:head].mean(axis=0))[head:])
            squares += [float((part**2).sum()) for part in parts]
            counts += [part.size for part in parts]
    before, removed, start = np.sqrt(squares / np.maximum(counts, 1))
    return float(before), float(removed), float(start)
