"""A run at a glance: one contact sheet, its frames over time from left to right."""

import io
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.runs.folder import Run
from depthsim.runs.storing import write_whole
from depthsim.runs.terminal import depth_span
from depthsim.scene import NO_TAG

_WIDTH, _DPI = 14.0, 100
"""The sheet is 1400 pixels wide, as wide as a README shows."""
_KEY = 1.45
"""Width [in] of the column at the right, for colour bars and legends."""
_LEFT, _TOP, _BOTTOM, _GAP, _ROW_GAP = 0.55, 0.62, 0.12, 0.06, 0.1
_NEAREST = {"interpolation": "nearest"}
"""Means would hide single holes and take noise for less than it is."""
_SHUFFLED = (*range(0, 20, 2), *range(1, 20, 2))
"""tab20 with its ten strong colours first."""
_INK, _HOLE = "#222222", "#000000"


@dataclass(frozen=True)
class _Row:
    """One kind of picture: its caption, a picture for each frame, and how values become colours."""

    caption: str
    pictures: list[NDArray[Any]]
    style: dict[str, Any]
    key: Callable[[Any, Any], None] | None = None


def preview(run: Run, path: Path, frames: int = 5) -> None:
    """Write a PNG contact sheet of ``run``: depth, and clean depth, error, materials and intensity where it has them.

    Raises :class:`~depthsim.errors.InputError` for a damaged picture, and where ``path`` cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    shown = run.spread(frames)
    rows = _rows(run, shown)
    columns = max(len(shown), 3)
    cell = (_WIDTH - _LEFT - _KEY - _GAP * (columns - 1)) / columns
    high = cell * run.camera.height / run.camera.width
    height = _TOP + _BOTTOM + len(rows) * (high + _ROW_GAP) - _ROW_GAP
    figure = Figure(figsize=(_WIDTH, height), dpi=_DPI, facecolor="white")
    FigureCanvasAgg(figure)

    def axes(left: float, top: float, width: float, tall: float) -> Any:
        """A box measured in inches from the upper left corner."""
        return figure.add_axes((left / _WIDTH, 1 - (top + tall) / height, width / _WIDTH, tall / height))

    figure.text(_LEFT / _WIDTH, 1 - 0.16 / height, _title(run), fontsize=11, va="center", color=_INK)
    for number, row in enumerate(rows):
        top = _TOP + number * (high + _ROW_GAP)
        middle = 1 - (top + high / 2) / height
        figure.text(0.28 / _WIDTH, middle, row.caption, fontsize=9, rotation=90, ha="center", va="center", color=_INK)
        for column, picture in enumerate(row.pictures):
            box = axes(_LEFT + column * (cell + _GAP), top, cell, high)
            image = box.imshow(picture, aspect="auto", **row.style)
            box.set_axis_off()
            if number == 0:
                stamp = run.stamps[shown[column]] - run.stamps[0]
                box.set_title(f"frame {shown[column]}, {stamp:.2f} s", fontsize=9, color=_INK, pad=4)
        if row.key is not None:
            row.key(axes(_WIDTH - _KEY + 0.15, top + 0.05, 0.14, high - 0.1), image)
    data = io.BytesIO()
    figure.savefig(data, format="png", metadata={"Software": None})
    write_whole(path, data.getvalue())


def _title(run: Run) -> str:
    parts = [str(run.meta.get("scene") or run.path.resolve().name), run.camera.name]
    parts += [f"{run.camera.width} x {run.camera.height} px", f"{len(run)} frames"]
    return "   ".join([*parts, f"{run.stamps[-1] - run.stamps[0]:.1f} s", "black: holes, or nothing there"])


def _rows(run: Run, shown: list[int]) -> list[_Row]:
    depth, clean = _pictures(run.depth, shown), _pictures(run.clean, shown)
    near, far = depth_span(np.stack(depth))
    metres = {"cmap": _map("turbo"), "norm": _log_norm(near, far), **_NEAREST}
    rows = [_Row("depth [m]", [_holes(picture, picture == 0) for picture in depth], metres, _depth_key)]
    if clean:
        rows.append(_Row("clean depth [m]", [_holes(picture, picture == 0) for picture in clean], metres, _depth_key))
        rows.append(_error_row(depth, clean))
    if material := _pictures(run.material, shown):
        rows.append(_material_row(material, run.tags))
    if run.has("rgb"):
        rows.append(_Row("intensity", _pictures(run.rgb, shown), {"cmap": "gray", "vmin": 0, "vmax": 255}))
    return rows


def _pictures(read: Callable[[int], NDArray[Any] | None], shown: list[int]) -> list[NDArray[Any]]:
    return [picture for index in shown if (picture := read(index)) is not None]


def _error_row(depth: list[NDArray[Any]], clean: list[NDArray[Any]]) -> _Row:
    errors = [_holes(1000 * (a - b), (a == 0) | (b == 0)) for a, b in zip(depth, clean, strict=True)]
    size = np.abs(np.concatenate([error.compressed() for error in errors]))
    most = _round_up(float(np.percentile(size, 98))) if size.size else 1.0
    style = {"cmap": _map("RdBu_r"), "vmin": -most, "vmax": most, **_NEAREST}
    return _Row("error [mm]\nmeasured - clean", errors, style, _bar)


def _material_row(pictures: list[NDArray[Any]], tags: tuple[str, ...]) -> _Row:
    from matplotlib import colormaps
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    ids = np.unique(np.concatenate([np.unique(picture) for picture in pictures]))
    ids = ids[ids != NO_TAG]
    colours = ListedColormap([colormaps["tab20"](_SHUFFLED[number % 20]) for number in range(NO_TAG)])

    def key(box: Any, image: Any) -> None:
        names = [tags[number] if number < len(tags) else f"number {number}" for number in ids]
        patches = [Patch(color=colours(int(number)), label=name) for number, name in zip(ids, names, strict=True)]
        box.set_axis_off()
        style = {"loc": "upper left", "bbox_to_anchor": (-0.4, 1.0), "frameon": False, "borderpad": 0.0}
        box.legend(
            handles=patches, fontsize=8, labelcolor=_INK, handlelength=1.2, labelspacing=0.3, borderaxespad=0, **style
        )

    style = {"cmap": colours.with_extremes(bad=_HOLE), "vmin": -0.5, "vmax": NO_TAG - 0.5, **_NEAREST}
    return _Row("material", [_holes(picture, picture == NO_TAG) for picture in pictures], style, key)


def _bar(box: Any, image: Any) -> Any:
    bar = image.figure.colorbar(image, cax=box)
    bar.outline.set_visible(False)
    bar.ax.tick_params(which="both", labelsize=8, colors=_INK, length=2)
    return bar


def _depth_key(box: Any, image: Any) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

    bar = _bar(box, image)
    wide = image.norm.vmax > 6 * image.norm.vmin
    few, many = MaxNLocator(5, steps=[1, 2, 5, 10]), LogLocator(subs=(1.0, 2.0, 3.0, 5.0), numticks=99)
    bar.ax.yaxis.set_major_locator(many if wide else few)
    bar.ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    bar.ax.yaxis.set_minor_locator(NullLocator())


def _log_norm(near: float, far: float) -> Any:
    from matplotlib.colors import LogNorm

    return LogNorm(near, far)


def _map(name: str) -> Any:
    from matplotlib import colormaps

    return colormaps[name].with_extremes(bad=_HOLE)


def _holes(picture: NDArray[Any], holes: NDArray[np.bool_]) -> Any:
    return np.ma.masked_array(picture, holes)


def _round_up(value: float) -> float:
    """The next of 1, 2, 5, 10, 20, ..."""
    power = 10.0 ** np.floor(np.log10(max(value, 1e-6)))
    return next(power * step for step in (1, 2, 5, 10) if power * step >= value * (1 - 1e-9))
