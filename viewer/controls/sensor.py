"""Which sensor: its profile, camera, resolution and seed, and the second profile to compare it with."""

from collections.abc import Callable

import viser

from depthsim.camera import Camera
from depthsim.presets import MODES, PRESETS, preset
from depthsim.sensor import Profile, load_profile
from depthsim.sensor.profile import profile_names
from viewer.controls.handles import picked

GIVEN = "as given"


class SensorControls:
    """The choices are by name. ``given``: the profile and the camera that the page was opened with."""

    def __init__(
        self,
        gui: viser.GuiApi,
        given: Profile,
        camera: Camera,
        changed: Callable[[], None],
        profile_chosen: Callable[[Profile], None],
    ) -> None:
        self._given, self._camera = given, camera
        names = profile_names()
        first = given.name if given.name in names and load_profile(given.name) == given else GIVEN
        options = names if first in names else [GIVEN, *names]
        self.profile = gui.add_dropdown(
            "profile", options, initial_value=first, hint="Sets all effects; turn them then as you like."
        )
        self.model = gui.add_dropdown(
            "camera",
            [GIVEN, *PRESETS],
            initial_value=GIVEN,
            hint=f"{GIVEN}: {camera.name}, {camera.width}x{camera.height} px.",
        )
        sizes = [f"{width}x{height}" for width, height in MODES]
        self.size = gui.add_dropdown(
            "resolution [px]",
            [GIVEN, *sizes],
            initial_value=GIVEN,
            hint="Of a preset; the field of view is the camera's own.",
        )
        self.seed = gui.add_number("seed", 0, min=0, max=2**31 - 1, step=1, hint="Of the random numbers.")
        self.second = gui.add_dropdown(
            "second profile", names, initial_value="clean" if first != "clean" else "d435",
            hint="What `second sensor` shows, with the same camera and seed.",
        )  # fmt: skip
        self.profile.on_update(lambda _: profile_chosen(self.chosen_profile()))
        for handle in (self.model, self.size, self.seed, self.second):
            handle.on_update(lambda _: changed())

    def chosen_profile(self) -> Profile:
        """The profile as it is on file."""
        return self._given if self.profile.value == GIVEN else load_profile(picked(self.profile))

    def second_profile(self) -> Profile:
        """What to compare with."""
        return load_profile(picked(self.second))

    def camera(self) -> Camera:
        """The camera, at the chosen resolution. Raises :class:`~depthsim.errors.InputError`."""
        size = _size(picked(self.size))
        name = picked(self.model)
        if name == GIVEN:
            if size is None or size == (self._camera.width, self._camera.height):
                return self._camera
            if self._camera.name.lower() not in PRESETS:
                return _resized(self._camera, *size)
            name = self._camera.name.lower()
        width, height = size or (None, None)
        return preset(name, width, height, self._camera.rate)


def _size(text: str) -> tuple[int, int] | None:
    if text == GIVEN:
        return None
    width, _, height = text.partition("x")
    return int(width), int(height)


def _resized(camera: Camera, width: int, height: int) -> Camera:
    """The same view of a camera of one's own in another number of pixels, its full width kept."""
    scale = width / camera.width
    return camera.model_copy(
        update={
            "width": width,
            "height": height,
            "fx": camera.fx * scale,
            "fy": camera.fy * scale,
            "cx": (camera.cx + 0.5) * scale - 0.5,
            "cy": (camera.cy + 0.5 - camera.height / 2) * scale + height / 2 - 0.5,
        }
    )
