"""How the pictures of a report look: one set of colours, one way to draw them."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure

REAL, SIMULATED, FIXED = "#1d2733", "#e8830c", "#1f6feb"
"""The colours of the recording, of its simulation, and of the simulation with the causes added."""
TIED, OTHER, SOFT = "#9dc1f7", "#c3ccd6", "#5b6875"
SHARE = LinearSegmentedColormap.from_list("share", ["#eef1f4", "#fbd9a5", "#ee8a3c", "#c5361d", "#6d0b1c"])
"""Shares of the gap: none is pale, most is dark."""
_STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 9.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": "#9aa5b1",
    "axes.labelcolor": SOFT,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "grid.color": "#e6ebf0",
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "legend.frameon": False,
    "figure.facecolor": "white",
}


@dataclass(frozen=True)
class Picture:
    """A PNG and what is said under it."""

    png: bytes
    caption: str


@contextmanager
def figure(width: float, height: float) -> Iterator[Figure]:
    """A figure of ``width`` x ``height`` inches in the report's style."""
    with rc_context(_STYLE):
        yield Figure((width, height), layout="constrained")


def png(drawn: Figure) -> bytes:
    """The figure's PNG; the same figure gives the same bytes."""
    out = io.BytesIO()
    metadata: dict[str, Any] = {"Software": None}
    drawn.set_dpi(130)
    FigureCanvasAgg(drawn).print_png(out, metadata=metadata)  # savefig draws twice, to lay out what it then draws
    return out.getvalue()
