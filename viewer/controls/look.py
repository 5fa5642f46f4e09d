"""What is shown and how: the side or sides, colours, mesh, points, and where one looks from."""

from collections.abc import Callable
from typing import Literal, cast

import viser

from viewer.controls.handles import picked, put
from viewer.drawing import View
from viewer.paint import COLOURINGS, Colouring
from viewer.screen import Style
from viewer.stage import Stage

Side = Literal["recording", "sensor", "clean", "second sensor"]
NOTHING = "nothing"
AUTOMATIC, ALL = "as many as keep up", "all"
_THINNINGS = {"1 in 2": 2, "1 in 4": 4, "1 in 8": 8, "1 in 16": 16}
_FEW, _MOST = 12, 100
"""So many objects are listed at once; and so many have a box to hide them."""


class LookControls:
    """Choices of the View tab."""

    def __init__(self, gui: viser.GuiApi, stage: Stage, changed: Callable[[], None]) -> None:
        sides = (["recording"] if stage.run is not None else []) + (
            ["sensor", "clean", "second sensor"] if stage.scene is not None else []
        )
        shares = stage.report is not None and stage.report.shares is not None
        self.show = gui.add_dropdown(
            "show", sides, initial_value=sides[0], hint="recording: the frames on disk; sensor: as set here."
        )
        self.beside = gui.add_dropdown(
            "beside it", [NOTHING, *sides], initial_value=NOTHING, hint="A second cloud and picture next to the first."
        )
        self.colouring = gui.add_dropdown(
            "colours", list(COLOURINGS), initial_value="depth", hint="Of cloud and picture."
        )
        meshes = ["material", *(["share"] if shares else []), "hidden"]
        self.mesh = gui.add_dropdown(
            "mesh", meshes, initial_value="share" if shares else "material", visible=stage.scene is not None,
            hint="Colours of the scene: material tags, or each face's share of the gap.",
        )  # fmt: skip
        self.opacity = gui.add_slider("mesh opacity", 0.05, 1.0, 0.05, 0.3, visible=stage.scene is not None)
        self.points = gui.add_dropdown(
            "points", [AUTOMATIC, ALL, *_THINNINGS], initial_value=AUTOMATIC,
            hint="While it plays, a cloud that is too much for the browser is thinned; the page says how much.",
        )  # fmt: skip
        self.share_plane = gui.add_checkbox(
            "gap on the image plane", shares, visible=shares, hint="Where in the image the gap lies, in place of depth."
        )
        self.frustum = gui.add_checkbox("camera and path", True)
        self.objects: dict[int, viser.GuiCheckboxHandle] = {}
        if stage.objects:
            with gui.add_folder("objects", expand_by_default=len(stage.objects) <= _FEW):
                for number, name in list(stage.objects.items())[:_MOST]:
                    self.objects[number] = gui.add_checkbox(name, True)
        self.places = gui.add_button_group("look", ["over its shoulder", "through it", "from outside"])
        self.dark = gui.add_checkbox("dark", True)
        chosen = (self.show, self.beside, self.colouring, self.mesh, self.opacity, self.points, self.share_plane)
        for handle in chosen:
            handle.on_update(lambda _: changed())
        for box in self.objects.values():
            box.on_update(lambda _: changed())
        self.frustum.on_update(lambda _: changed())

    def sides(self) -> list[Side]:
        """One side, or two."""
        chosen = [picked(self.show)] + ([] if self.beside.value == NOTHING else [picked(self.beside)])
        return cast(list[Side], chosen)

    def how(self) -> Colouring:
        """The colouring that was chosen."""
        return cast(Colouring, picked(self.colouring))

    def style(self, *, moving_by_keys: bool, view: View | None) -> Style:
        """How to show a frame. view: of a browser that is sent pictures of it."""
        return Style(
            how=self.how(),
            mesh=picked(self.mesh),
            opacity=float(self.opacity.value),
            frustum=self.frustum.value and not moving_by_keys,  # one looks from where it would stand
            gap_plane=self.share_plane.value,
            dark=bool(self.dark.value),
            hidden=frozenset(number for number, handle in self.objects.items() if not handle.value),
            view=view,
        )

    def thinning(self) -> int | None:
        """1 in how many points is shown; None to find it out."""
        if self.points.value == AUTOMATIC:
            return None
        return _THINNINGS.get(self.points.value, 1)

    def show_sensor(self) -> None:
        """Make sure that what the sensor's controls do can be seen."""
        if self.show.value != "sensor" and self.beside.value != "sensor":
            put(self.show, "sensor")
