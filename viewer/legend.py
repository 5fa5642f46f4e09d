"""What the colours mean, as a bar or as patches under the picture."""

import html

import numpy as np
from numpy.typing import NDArray

from depthsim.materials import Materials
from viewer import colours
from viewer.paint import Colouring, Span
from viewer.shot import Shot

_TEXT = "font-size:0.75em;line-height:1.5;opacity:0.85"
_INSIDE = (1, 1.5, 2, 3, 5, 7)


def legend(how: Colouring, span: Span, shot: Shot, tags: tuple[str, ...], materials: Materials) -> str:
    """The legend of a frame's colours, as HTML."""
    if how == "validity":
        fates = list(enumerate(colours.FATES))
        there = fates if shot.clean is not None else fates[1:]
        return _patches([(name, colours.FATE[number]) for number, name in there])
    if how == "material" and shot.tag is not None:
        palette = colours.material_colours(tags, materials)
        seen = np.bincount(shot.tag[::4, ::4].ravel(), minlength=256)[: len(tags)]
        order = [int(index) for index in np.argsort(-seen) if seen[index]]
        return _patches([(tags[index], palette[index]) for index in order[:12]])
    if how == "error" and shot.clean is not None:
        most = 1000 * span.error
        return _bar(colours.ERROR, [(0.0, f"−{most:g} mm"), (0.5, "error 0"), (1.0, f"+{most:g} mm")])
    width = np.log(span.far / span.near)
    powers = [step * 10.0**power for power in range(-2, 3) for step in _INSIDE]
    inside = [value for value in powers if 1.12 * span.near < value < span.far / 1.12]
    inside = inside[:: max(1, -(-len(inside) // 4))]
    ticks = [(float(np.log(value / span.near) / width), f"{value:g}") for value in inside]
    return _bar(colours.DEPTH, [(0.0, f"{span.near:g}"), *ticks, (1.0, f"{span.far:g} m")])


def share_legend() -> str:
    """The legend of the shares of the gap."""
    return _bar(colours.SHARE, [(0.0, "no gap here"), (1.0, "most of the gap")])


def _bar(palette: colours.Palette, ticks: list[tuple[float, str]]) -> str:
    stops = ",".join(colours.hex_colour(palette[place]) for place in np.linspace(0, 255, 18).astype(int))
    labels = "".join(
        f'<span style="position:absolute;white-space:nowrap;left:{100 * place:.1f}%;'
        f'transform:translateX(-{100 * place:.0f}%)">'
        f"{html.escape(text)}</span>"
        for place, text in ticks
    )
    return (
        f'<div style="{_TEXT};margin:0 0.75em 0.4em"><div style="height:0.8em;border-radius:0.3em;'
        f'background:linear-gradient(to right,{stops})"></div>'
        f'<div style="position:relative;height:1.6em">{labels}</div></div>'
    )


def _patches(entries: list[tuple[str, NDArray[np.uint8]]]) -> str:
    spans = "".join(
        f'<span style="white-space:nowrap;margin-right:1em"><span style="display:inline-block;width:0.8em;'
        f'height:0.8em;border-radius:0.2em;margin-right:0.35em;background:{colours.hex_colour(colour)}"></span>'
        f"{html.escape(name)}</span>"
        for name, colour in entries
    )
    return f'<div style="{_TEXT};margin:0 0.75em 0.4em">{spans}</div>'
