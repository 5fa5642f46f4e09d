"""What stays from frame to frame in a browser's 3D view: the mesh, the camera's path, where one looks from."""

from functools import cache
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from depthsim.moving import tracks
from viewer import meshes
from viewer.drawing import Drawing
from viewer.stage import Stage

ORANGE = (255, 140, 0)


@cache
def _groups(stage: Stage, how: str) -> list[meshes.Group]:
    """All browsers share the arrays."""
    if stage.scene is None:
        return []
    if how == "share" and stage.report is not None and stage.report.shares is not None:
        return meshes.by_share(stage.scene, stage.report.shares.face)
    return meshes.by_material(stage.scene, stage.materials)


class Scenery:
    """Mesh and path, once or twice side by side."""

    def __init__(self, client: viser.ClientHandle, stage: Stage) -> None:
        self._client, self._stage = client, stage
        self._drawn: dict[str, tuple[Any, ...]] = {}
        self._made: dict[str, tuple[Any, ...]] = {}
        self._meshes: dict[str, list[Any]] = {}
        self._of: dict[str, list[meshes.Group]] = {}
        self._placed: dict[str, tuple[float, frozenset[int]]] = {}
        self._path: Any = None
        self._segments = np.empty((0, 2, 3), np.float32)
        client.scene.set_up_direction("+z")
        self._light()

    def _light(self) -> None:
        """Light from all around, without shadows: a browser without a GPU spends a second a frame on viser's own."""
        api = self._client.scene
        api.configure_default_lights(enabled=False)
        api.configure_environment_map(hdri=None)
        api.add_light_hemisphere("/light/sky", sky_color=(255, 255, 255), ground_color=(96, 98, 110), intensity=2.2)
        api.add_light_directional("/light/sun", intensity=1.4, position=(0.4, 0.25, 1.0))

    def apart(self) -> NDArray[np.float64]:
        """(3,) how far the second picture of the scene is from the first [m]: to the first camera's right, level."""
        right = self._stage.trajectory.matrices()[0][:3, 0].copy()
        right[2] = 0
        axis = int(np.argmax(np.abs(right)))
        low, high = self._stage.bounds
        step = np.zeros(3)
        step[axis] = np.copysign(1.06 * (high - low)[axis] + 0.3, right[axis])
        return step

    def show_mesh(self, side: str, how: str, opacity: float, offset: NDArray[np.float64]) -> None:
        """Draw the mesh of one side: how is material, share or hidden. What the browser has is not sent again."""
        wanted = (how, opacity, *offset)
        if self._drawn.get(side) == wanted:
            return
        handles = self._meshes.get(side, [])
        kept = self._made.get(side) == (how, *offset)
        if how != "hidden" and not kept:
            for handle in handles:
                handle.remove()
            groups = _groups(self._stage, how)
            handles = [self._add(side, group, opacity, offset) for group in groups]
            self._meshes[side], self._made[side], self._of[side] = handles, (how, *offset), groups
            self._placed.pop(side, None)
        self._placed.pop(side, None)  # which of them are in sight is seen to afterwards
        for handle in handles:
            handle.visible = how != "hidden"
            if how != "hidden" and handle.opacity != _opacity(opacity):
                handle.opacity = _opacity(opacity)
        self._drawn[side] = wanted

    def place_objects(self, side: str, stamp: float, hidden: frozenset[int], offset: NDArray[np.float64]) -> None:
        """Put the objects that move where they are at ``stamp`` [s], and take the ``hidden`` ones out of sight."""
        scene, shown = self._stage.scene, self._drawn.get(side, ("hidden",))[0] != "hidden"
        if scene is None or len(scene.objects) == 1 or not shown or self._placed.get(side) == (stamp, hidden):
            return
        found = tracks(scene.movers, stamp)
        for handle, group in zip(self._meshes.get(side, []), self._of.get(side, []), strict=True):
            handle.visible = group.instance not in hidden
            if group.mover is not None:
                (place,), ((x, y, z, w),) = found[group.mover]
                handle.position, handle.wxyz = tuple(place + offset), (w, x, y, z)
        self._placed[side] = stamp, hidden

    def _add(self, side: str, group: meshes.Group, opacity: float, offset: NDArray[np.float64]) -> Any:
        return self._client.scene.add_mesh_simple(
            f"/{side}/mesh/{group.name}",
            group.vertices,
            group.faces,
            color=group.colour,
            flat_shading=True,
            side="front",  # of a room one sees the inside, from wherever one looks
            opacity=_opacity(opacity),
            cast_shadow=False,
            receive_shadow=False,
            position=tuple(offset),
        )

    def show_path(self, positions: NDArray[np.float64]) -> None:
        """Draw the camera's path, (N, 3) [m]."""
        if len(positions) > 1:
            step = max(1, len(positions) // 2000)
            line = positions[::step]
            self._segments = np.stack([line[:-1], line[1:]], axis=1).astype(np.float32)
            self._path = self._client.scene.add_line_segments(
                "/path", self._segments, ORANGE, thickness=2.0, thickness_units="screen"
            )

    def see_path(self, visible: bool) -> None:
        """Show or hide the path."""
        if self._path is not None:
            self._path.visible = visible

    def draw_path(self, onto: Drawing) -> None:
        """Draw the path into a picture of the view."""
        onto.lines(self._segments, ORANGE, np.eye(4))

    def look_from_behind(self, pose: NDArray[np.float64], depth: float) -> None:
        """Look over the camera's shoulder. depth: of what it typically sees [m]."""
        back = float(np.clip(0.45 * depth, 0.4, 6.0))
        eye = pose[:3, 3] - back * pose[:3, 2] + np.array([0, 0, 0.45 * back])
        self._look(eye, pose[:3, 3] + 0.5 * depth * pose[:3, 2])

    def look_through(self, pose: NDArray[np.float64], depth: float) -> None:
        """Look from where the camera is."""
        self._look(pose[:3, 3], pose[:3, 3] + max(depth, 0.5) * pose[:3, 2])

    def look_from_outside(self, beside: bool) -> None:
        """Look at everything, from above and aside; ``beside``: at both pictures of the scene."""
        corners = self._stage.bounds
        if beside:
            step = self.apart()
            corners = np.stack([corners[0] + np.minimum(step, 0), corners[1] + np.maximum(step, 0)])
        middle, size = corners.mean(axis=0), corners[1] - corners[0]
        along = self._stage.trajectory.matrices()[0][:3, 2]
        level = np.array([along[0], along[1], 0.0])
        level /= max(np.linalg.norm(level), 1e-9)
        reach = 0.62 * float(np.hypot(size[0], size[1])) + 0.3 * float(size[2])
        self._look(middle + reach * (np.array([0, 0, 0.75]) - 0.75 * level), middle)

    def _look(self, eye: NDArray[np.float64], target: NDArray[np.float64]) -> None:
        camera, along = self._client.camera, target - eye
        if np.hypot(along[0], along[1]) < 0.02 * abs(along[2]):
            eye = eye - np.array([0.02 * abs(along[2]), 0, 0])  # straight up or down there would be no upright view
        with self._client.atomic():
            camera.up_direction = (0.0, 0.0, 1.0)
            camera.position = tuple(eye)
            camera.look_at = tuple(target)


def _opacity(opacity: float) -> float | None:
    return None if opacity >= 1 else opacity
