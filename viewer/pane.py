"""One of the one or two sides of a browser's 3D view that change with every frame: cloud, frustum and label."""

from functools import lru_cache
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from depthsim.camera import Camera
from viewer.cloud import Cloud
from viewer.drawing import Drawing
from viewer.scenery import ORANGE
from viewer.shot import Shot

_SCALE = 0.16
"""[m] The frustum's size, as viser has it."""
_EDGES = np.array(
    [
        [[-1, -1, 1], [1, -1, 1]], [[1, -1, 1], [1, 1, 1]], [[1, 1, 1], [-1, 1, 1]], [[-1, 1, 1], [-1, -1, 1]],
        [[0, 0, 0], [-1, -1, 1]], [[0, 0, 0], [1, -1, 1]], [[0, 0, 0], [1, 1, 1]], [[0, 0, 0], [-1, 1, 1]],
        [[0, -1.2, 1], [0, -1, 1]],
    ],
    np.float64,
)  # fmt: skip
"""Of viser's frustum, and the mark over its image plane."""


class Pane:
    """Cloud and camera of one side. The nodes carry the camera's pose, and points are sent as they were measured."""

    def __init__(self, client: viser.ClientHandle, side: str, offset: NDArray[np.float64]) -> None:
        self._client, self._side, self.offset = client, side, offset
        self._cloud: Any = None
        self._frustum: Any = None
        self._label: Any = None

    def show(self, shot: Shot, cloud: Cloud, picture: NDArray[np.uint8] | None, title: str) -> None:
        """Put one frame there. picture: on the image plane, (rows, columns, 3) RGB. title: over the camera."""
        api, camera = self._client.scene, shot.camera
        wxyz, position = _wxyz(shot.pose), tuple(shot.pose[:3, 3] + self.offset)
        self._name(shot, title)
        if self._cloud is None:
            self._cloud = api.add_point_cloud(
                f"/{self._side}/cloud",
                cloud.points,
                cloud.colours,
                point_size=cloud.size,
                point_shape="square",
                point_shading="flat",
                precision="float32",
                wxyz=wxyz,
                position=position,
            )
            self._frustum = api.add_camera_frustum(
                f"/{self._side}/camera",
                fov=2 * float(np.arctan(camera.height / 2 / camera.fy)),
                aspect=camera.width / camera.height,
                scale=_SCALE,
                thickness=2.0,
                thickness_units="screen",
                color=ORANGE,
                image=picture,
                format="jpeg",
                jpeg_quality=85,
                cast_shadow=False,
                receive_shadow=False,
                wxyz=wxyz,
                position=position,
            )
            return
        self._cloud.points, self._cloud.colors, self._cloud.point_size = cloud.points, cloud.colours, cloud.size
        self._frustum.fov = 2 * float(np.arctan(camera.height / 2 / camera.fy))
        self._frustum.aspect = camera.width / camera.height
        self._frustum.image = picture
        for handle in (self._cloud, self._frustum):
            handle.wxyz, handle.position = wxyz, position

    def draw(
        self, onto: Drawing, shot: Shot, cloud: Cloud, picture: NDArray[np.uint8] | None, *, frustum: bool
    ) -> None:
        """Draw what :meth:`show` would have the browser draw."""
        pose = shot.pose.copy()
        pose[:3, 3] += self.offset
        onto.points(cloud.points, cloud.colours, cloud.size, pose)
        if frustum:
            onto.lines(_EDGES * _corner(shot.camera), ORANGE, pose)
            if picture is not None:
                plane, size = _plane(shot.camera, *picture.shape[:2])
                onto.points(plane, picture.reshape(-1, 3), size, pose)

    def hide(self, shot: Shot, title: str, *, label: bool) -> None:
        """Leave all but the label to a picture of the view."""
        self._name(shot, title)
        for handle in (self._cloud, self._frustum):
            if handle is not None:
                handle.visible = False
        self._label.visible = label

    def see(self, *, frustum: bool, label: bool) -> None:
        """Show or hide the camera's frustum and the label."""
        self._cloud.visible, self._frustum.visible, self._label.visible = True, frustum, label

    def _name(self, shot: Shot, title: str) -> None:
        if self._label is None:
            name = f"/{self._side}/label"
            self._label = self._client.scene.add_label(name, title, position=self._over(shot), anchor="bottom-center")
        self._label.text, self._label.position = title, self._over(shot)

    def _over(self, shot: Shot) -> NDArray[np.float64]:
        return np.asarray(shot.pose[:3, 3] + self.offset + np.array([0, 0, 0.16]))

    def remove(self) -> None:
        """Take it away."""
        for handle in (self._cloud, self._frustum, self._label):
            if handle is not None:
                handle.remove()
        self._cloud = self._frustum = self._label = None


def _corner(camera: Camera) -> NDArray[np.float64]:
    """(3,) the frustum's lower right corner [m], in the camera's frame."""
    y = camera.height / 2 / camera.fy
    corner = np.array([y * camera.width / camera.height, y, 1.0])
    return np.asarray(_SCALE * corner / np.cbrt(corner.prod() / 3))


@lru_cache(maxsize=4)
def _plane(camera: Camera, rows: int, columns: int) -> tuple[NDArray[np.float32], float]:
    """(rows * columns, 3) where the pixels of the picture on the image plane are, and half of what one is wide [m]."""
    v, u = np.mgrid[1 - rows : rows : 2, 1 - columns : columns : 2].reshape(2, -1)
    corner = _corner(camera)
    plane = np.stack([u / columns, v / rows, np.ones(u.size)], axis=1) * corner
    return plane.astype(np.float32), float(1.1 * corner[1] / rows)


def _wxyz(pose: NDArray[np.float64]) -> tuple[float, float, float, float]:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return float(w), float(x), float(y), float(z)
