"""What one browser sees of its frames: clouds and cameras in the 3D view, the picture beside it, and its legend."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import viser
from numpy.typing import NDArray

from viewer.cloud import make_cloud
from viewer.legend import legend, share_legend
from viewer.paint import Colouring, Painted, Span, paint
from viewer.pane import Pane
from viewer.pictures import frame_picture, share_picture, side_by_side
from viewer.scenery import Scenery
from viewer.shot import Shot
from viewer.stage import Stage

_PLANE = 240
"""[px] Width of the picture on the image plane in the 3D view."""
_PANES = "ab"


@dataclass(frozen=True)
class Style:
    """how: what the colours mean. mesh: material, share or hidden. gap_plane: the gap's shares on the image plane."""

    how: Colouring
    mesh: str
    opacity: float
    frustum: bool
    gap_plane: bool


class Screen:
    """Keeps what was sent, and sends what is new."""

    def __init__(self, client: viser.ClientHandle, stage: Stage) -> None:
        self._client, self._stage = client, stage
        self.scenery = Scenery(client, stage)
        self._panes: dict[str, Pane] = {}
        self._span = Span()
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
        self, sides: Sequence[str], shots: Mapping[str, Shot], one_in: int, style: Style, wait: Callable[[], object]
    ) -> int:
        """Send the frames of one or two sides; how many points they have in all that was sent.

        wait: called when all is worked out, before anything is sent.
        """
        how, tags, known = style.how, self._stage.tags, self._stage.materials
        # A clean frame would narrow the colours of errors to nothing.
        self._span = self._span.fitted(shots[next((side for side in sides if side != "clean"), sides[0])])
        painted = [paint(shots[side], how, self._span, tags, known) for side in sides]
        clouds = [
            make_cloud(shots[side], colours, one_in, with_holes=how == "validity")
            for side, colours in zip(sides, painted, strict=True)
        ]
        pictures = [frame_picture(shots[side], colours, how) for side, colours in zip(sides, painted, strict=True)]
        meaning = legend(how, self._span, shots[sides[0]], tags, known)
        if style.gap_plane or style.mesh == "share":
            meaning += share_legend()
        apart = self.scenery.apart()
        beside = side_by_side(pictures)
        wait()
        with self._client.atomic():
            for name in list(self._panes)[len(sides) :]:
                self._panes.pop(name).remove()
                self.scenery.show_mesh(name, "hidden", 1.0, apart)
            for name, side, cloud, colours in zip(_PANES, sides, clouds, painted, strict=False):
                offset = apart if name == _PANES[1] else np.zeros(3)
                pane = self._panes.setdefault(name, Pane(self._client, name, offset))
                pane.show(shots[side], cloud, self._plane(shots[side], colours, style), side)
                pane.see(frustum=style.frustum, label=len(sides) > 1)
                self.scenery.show_mesh(name, style.mesh, style.opacity, offset)
            self._picture.image = beside
            if meaning != self._legend.content:
                self._legend.content = meaning
        return sum(len(cloud.points) for cloud in clouds)

    def _plane(self, shot: Shot, painted: Painted, style: Style) -> NDArray[np.uint8]:
        """The picture on the image plane: the frame, or where in the image the gap lies."""
        report = self._stage.report
        if style.gap_plane and report is not None and report.shares is not None:
            return share_picture(report.shares.image, shot.camera.shape)
        return frame_picture(shot, painted, style.how, _PLANE)
