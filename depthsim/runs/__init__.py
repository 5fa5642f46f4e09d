"""The recorded-run folder: one reader, one writer; looked up when they are asked for, as a PNG file needs neither."""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from depthsim.runs.folder import Run
    from depthsim.runs.writer import RunWriter

__all__ = ["Run", "RunWriter"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from depthsim.runs.folder import Run
    from depthsim.runs.writer import RunWriter

    globals().update(Run=Run, RunWriter=RunWriter)
    return globals()[name]
