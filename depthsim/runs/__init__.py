"""The recorded-run folder: one reader, one writer."""

from depthsim.runs.folder import Run
from depthsim.runs.writer import RunWriter

__all__ = ["Run", "RunWriter"]
