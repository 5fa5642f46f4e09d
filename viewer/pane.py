"""One of the one or two sides of a browser's 3D view that change with every frame: cloud, frustum and label."""

from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from viewer.cloud import Cloud
from viewer.scenery import ORANGE
from viewer.shot import Shot


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
                scale=0.16,
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
            name = f"/{self._side}/label"
            self._label = api.add_label(name, title, position=self._over(shot), anchor="bottom-center")
            return
        self._cloud.points, self._cloud.colors, self._cloud.point_size = cloud.points, cloud.colours, cloud.size
        self._frustum.fov = 2 * float(np.arctan(camera.height / 2 / camera.fy))
        self._frustum.aspect = camera.width / camera.height
        self._frustum.image = picture
        for handle in (self._cloud, self._frustum):
            handle.wxyz, handle.position = wxyz, position
        self._label.text, self._label.position = title, self._over(shot)

    def see(self, *, frustum: bool, label: bool) -> None:
        """Show or hide the camera's frustum and the label."""
        if self._frustum is not None:
            self._frustum.visible, self._label.visible = frustum, label

    def _over(self, shot: Shot) -> NDArray[np.float64]:
        return np.asarray(shot.pose[:3, 3] + self.offset + np.array([0, 0, 0.16]))

    def remove(self) -> None:
        """Take it away."""
        for handle in (self._cloud, self._frustum, self._label):
            if handle is not None:
                handle.remove()
        self._cloud = self._frustum = self._label = None


def _wxyz(pose: NDArray[np.float64]) -> tuple[float, float, float, float]:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return float(w), float(x), float(y), float(z)
