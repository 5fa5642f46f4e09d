"""What one browser sees of its frames: clouds and cameras in the 3D view, the picture beside it, and its legend."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from viewer.cloud import make_cloud
from viewer.drawing import Drawing, View
from viewer.legend import legend, share_legend
from viewer.paint import Colouring, Painted, Span, paint
from viewer.pane import Pane
from viewer.pictures import frame_picture, share_picture, side_by_side
from viewer.scenery import Scenery
from viewer.shot import Shot
from viewer.software import draw_once
from viewer.stage import Stage

_PLANE = 240
"""[px] Width of the picture on the image plane in the 3D view."""
_PANES = "ab"
_DARK, _LIGHT = (20, 20, 20), (255, 255, 255)
"""What viser has behind its 3D view."""


@dataclass(frozen=True)
class Style:
    """how: what the colours mean. mesh: material, share or hidden. gap_plane: the gap's shares on the image plane.

    hidden: numbers of objects out of sight. dark: the page. view: where a browser looks from that is sent pictures
    of its 3D view; None for one that draws it.
    """

    how: Colouring
    mesh: str
    opacity: float
    frustum: bool
    gap_plane: bool
    dark: bool
    hidden: frozenset[int] = frozenset()
    view: View | None = None


class Screen:
    """Keeps what was sent, and sends what is new."""

    def __init__(self, client: viser.ClientHandle, stage: Stage) -> None:
        self._client, self._stage = client, stage
        self.scenery = Scenery(client, stage)
        self._panes: dict[str, Pane] = {}
        self._span, self._pictured = Span(), False
        panel = client.gui.add_panel()
        with panel.add_tab("Picture"):
            self._picture = client.gui.add_image(np.zeros((2, 2, 3), np.uint8), format="jpeg", jpeg_quality=88)
            self._legend = client.gui.add_html("")
        panel.float(x=14, y=-14, width=430)

    @property
    def middle_depth(self) -> float:
        """The geometric mean of the nearest and the farthest depth that have a colour [m]."""
        return float(np.sqrt(self._span.near * self._span.far))

    def show(
        self,
        sides: Sequence[str],
        shots: Mapping[str, Shot],
        one_in: int,
        style: Style,
        wait: Callable[[], object],
        stamp: float = 0.0,
    ) -> int:
        """Send the frames of one or two sides; how many points they have in all that was sent.

        stamp: of the frames [s]. wait: called when all is worked out, before anything is sent.
        """
        how, tags, known = style.how, self._stage.tags, self._stage.materials
        # A clean frame would narrow the colours of errors to nothing.
        self._span = self._span.fitted(shots[next((side for side in sides if side != "clean"), sides[0])])
        painted = [paint(shots[side], how, self._span, tags, known) for side in sides]
        clouds = [
            make_cloud(shots[side].without(style.hidden), colours, one_in, with_holes=how == "validity")
            for side, colours in zip(sides, painted, strict=True)
        ]
        pictures = [frame_picture(shots[side], colours, how) for side, colours in zip(sides, painted, strict=True)]
        meaning = legend(how, self._span, shots[sides[0]], tags, known)
        if style.gap_plane or style.mesh == "share":
            meaning += share_legend()
        apart = self.scenery.apart()
        beside = side_by_side(pictures)
        planes = [self._plane(shots[side], colours, style) for side, colours in zip(sides, painted, strict=True)]
        panes = [self._pane(name, apart) for name in _PANES[: len(sides)]]
        drawn = None
        if style.view is not None:
            drawing = Drawing(style.view)
            self.scenery.draw_path(drawing)
            for pane, side, cloud, plane in zip(panes, sides, clouds, planes, strict=True):
                pane.draw(drawing, shots[side], cloud, plane, frustum=style.frustum)
            drawn = drawing.picture(_DARK if style.dark else _LIGHT)
        wait()
        with self._client.atomic():
            for name in list(self._panes)[len(sides) :]:
                self._panes.pop(name).remove()
                self.scenery.show_mesh(name, "hidden", 1.0, apart)
            for name, pane, side, cloud, plane in zip(_PANES, panes, sides, clouds, planes, strict=False):
                if drawn is None:
                    pane.show(shots[side], cloud, plane, side)
                    pane.see(frustum=style.frustum, label=len(sides) > 1)
                else:
                    pane.hide(shots[side], side, label=len(sides) > 1)
                self.scenery.show_mesh(name, style.mesh if drawn is None else "hidden", style.opacity, pane.offset)
                self.scenery.place_objects(name, stamp, style.hidden, pane.offset)
            self.scenery.see_path(drawn is None)
            if (drawn is not None) != self._pictured:
                self._pictured = drawn is not None
                draw_once(self._client, self._pictured)
                if drawn is None:
                    self._client.scene.set_background_image(None)
            if drawn is not None:
                self._client.scene.set_background_image(drawn, format="jpeg", jpeg_quality=92)
            self._picture.image = beside
            if meaning != self._legend.content:
                self._legend.content = meaning
        return sum(len(cloud.points) for cloud in clouds)

    def _pane(self, name: str, apart: NDArray[np.float64]) -> Pane:
        if name not in self._panes:
            self._panes[name] = Pane(self._client, name, apart if name == _PANES[1] else np.zeros(3))
        return self._panes[name]

    def _plane(self, shot: Shot, painted: Painted, style: Style) -> NDArray[np.uint8]:
        """The picture on the image plane: the frame, or where in the image the gap lies."""
        report = self._stage.report
        if style.gap_plane and report is not None and report.shares is not None:
            return share_picture(report.shares.image, shot.camera.shape)
        return frame_picture(shot, painted, style.how, _PLANE)
