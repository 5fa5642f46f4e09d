"""A depth frame as coloured text, for a terminal."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from rich.text import Text

_TURBO = np.frombuffer(
    bytes.fromhex(
        "30123b 3f3e9c 4666dd 458cfd 2fb2f4 1ad4d0 22ebaa 52fa7a 8bff4b "
        "b7f735 dbe236 f5c53a fea130 f9751d e84b0c ce2d04 a91601 7a0403"
    ),
    np.uint8,
).reshape(-1, 3)
"""Every fifteenth of the 256 colours of turbo (A. Mikhailov, 2019): matplotlib would take half a second to import."""
_HOLE = 16


def turbo(share: NDArray[np.floating]) -> NDArray[np.uint8]:
    """(..., 3) colours 0 to 255 of values from 0 to 1."""
    knots = np.linspace(0, 1, len(_TURBO))
    return np.rint(np.stack([np.interp(share, knots, channel) for channel in _TURBO.T], axis=-1)).astype(np.uint8)


def depth_span(depth: NDArray[np.floating]) -> tuple[float, float]:
    """The nearest and the farthest depth worth a colour [m]: 1 % of the returns lie outside; (1, 2) without any."""
    returns = depth[depth > 0]
    if not returns.size:
        return 1.0, 2.0
    near, far = np.percentile(returns, [0.5, 99.5])
    return float(near), float(max(far, near * 1.01))


def terminal_picture(depth: NDArray[np.float32], columns: int = 80) -> "Text":
    """A (height, width) depth frame [m] as half-block characters in turbo colours, and its scale (logarithmic) below.

    ``columns`` characters wide; 0 is a hole and dark. A terminal's cell is taken as twice as high as wide.
    """
    from rich.text import Text

    height, width = depth.shape
    columns = max(1, min(columns, width))
    rows = 2 * max(1, round(height * columns / width / 2))
    v = (np.arange(rows) * height + height // 2) // rows
    u = (np.arange(columns) * width + width // 2) // columns
    small = depth[np.minimum(v, height - 1)[:, None], np.minimum(u, width - 1)]  # a mean would invent depths at edges
    near, far = depth_span(depth)
    colours = turbo(np.log(np.maximum(small, near) / near) / np.log(far / near))
    colours[small == 0] = _HOLE
    text = Text(no_wrap=True)
    for upper, lower in zip(colours[::2].tolist(), colours[1::2].tolist(), strict=True):
        for above, below in zip(upper, lower, strict=True):
            text.append("▀", f"{_hex(above)} on {_hex(below)}")
        text.append("\n")
    labels = f"{near:.2f} m ", f" {far:.2f} m"
    bar = max(columns - len(labels[0]) - len(labels[1]), 1)
    text.append(labels[0])
    for colour in turbo(np.linspace(0, 1, bar)).tolist():
        text.append("▄", _hex(colour))
    text.append(labels[1])
    return text


def _hex(colour: list[int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)
