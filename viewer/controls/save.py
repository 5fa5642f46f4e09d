"""Saving the sensor's profile, the frame, and the picture, into the one folder that the viewer writes to."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import viser
from numpy.typing import NDArray

from depthsim.runs.png import encode_png
from depthsim.runs.storing import make_folder, write_whole
from depthsim.runs.writer import RunWriter
from depthsim.sensor import Profile
from depthsim.trajectory import Trajectory
from depthsim.units import to_depth_raw
from viewer.files import place_for
from viewer.shot import Shot


class SaveControls:
    """Names come from the browser, the folder does not. profile: whether there is a sensor whose profile to save."""

    def __init__(self, gui: viser.GuiApi, folder: Path, ask: Callable[[str], None], *, profile: bool) -> None:
        self._folder = folder
        self._name = gui.add_text("name", "mine", hint=f"Of a new file or folder in {folder}.")
        for label, what, hint in (
            (
                "save profile",
                "profile",
                "NAME.yaml: camera and effects as they are set; `--sensor NAME.yaml` takes it.",
            ),
            ("save frame", "frame", "NAME/: a run of this one frame, with clean depth and materials where known."),
            ("save picture", "picture", "NAME.png: the 3D view as it is now."),
        ):
            button = gui.add_button(label, hint=hint, visible=profile or what != "profile")
            button.on_click(lambda _, what=what: ask(what))  # type: ignore[misc]
        self._said = gui.add_markdown(f"Files go to `{folder}`.")

    def save_profile(self, profile: Profile) -> Path:
        """Write NAME.yaml."""
        path = self._new(".yaml")
        named = profile.model_copy(update={"name": path.stem})
        write_whole(path, named.to_yaml().encode())
        return self._tell(path)

    def save_frame(self, shot: Shot, stamp: float, tags: tuple[str, ...]) -> Path:
        """Write NAME/, a run of one frame."""
        from scipy.spatial.transform import Rotation

        path = self._new("")
        quaternion = Rotation.from_matrix(shot.pose[:3, :3]).as_quat()
        trajectory = Trajectory([stamp], shot.pose[None, :3, 3], quaternion[None])  # type: ignore[arg-type]
        pictures: dict[str, NDArray[Any]] = {"depth": shot.depth_raw}
        if shot.clean is not None:
            pictures["clean"] = to_depth_raw(shot.clean, shot.camera)
        if shot.tag is not None:
            pictures["material"] = shot.tag
        with RunWriter(path, shot.camera, trajectory, {"tags": list(tags)}, tuple(pictures)) as writer:
            writer.write_frame(0, pictures)
            writer.finish()
        return self._tell(path)

    def save_picture(self, client: viser.ClientHandle) -> Path:
        """Write NAME.png: what the browser shows, at its own size."""
        path = self._new(".png")
        camera = client.camera
        image = client.get_render(camera.image_height, camera.image_width, transport_format="png", timeout=60)
        write_whole(path, encode_png(image[..., :3].copy()))
        return self._tell(path)

    def _new(self, suffix: str) -> Path:
        path = place_for(self._folder, self._name.value, suffix)
        make_folder(self._folder)
        return path

    def _tell(self, path: Path) -> Path:
        self._said.content = f"Saved `{path}`."
        return path
