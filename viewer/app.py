"""The page: mesh, path, camera, point cloud and depth image, with a slider over the frames."""

import io
import threading
import time
from contextlib import redirect_stdout

import numpy as np
import viser
from numpy.typing import NDArray

from depthsim.materials import Materials, load_materials
from depthsim.runs.terminal import depth_span
from viewer.colours import depth_colours, material_colours
from viewer.source import Shot, Source

_MOST_POINTS = 120_000
"""Points sent for one frame; a cloud of more is thinned, and the page says so."""


class Viewer:
    """Serves one source to any number of browsers.

    host: 127.0.0.1 keeps it on this machine. port: the first free one from here is taken.
    """

    def __init__(
        self, source: Source, title: str, host: str = "127.0.0.1", port: int = 8080, materials: Materials | None = None
    ) -> None:
        self._source, self._materials = source, materials or load_materials()
        self._lock = threading.Lock()
        with redirect_stdout(io.StringIO()):  # viser greets on stdout, whatever `verbose` says
            self._server = viser.ViserServer(host=host, port=port, label=title, verbose=False)
        self._server.scene.set_up_direction("+z")
        self._add_scene()
        first = source.shot(0)
        self._span = depth_span(first.depth)
        self._add_controls(first)
        self._show(0)

    @property
    def url(self) -> str:
        """Where the page is."""
        return f"http://{self._server.get_host()}:{self._server.get_port()}"

    def run(self) -> None:
        """Serve until Ctrl-C; while `play` is on, go through the frames."""
        try:
            while True:
                begin = time.monotonic()
                if self._play.value:
                    self._frame.value = (self._frame.value + 1) % len(self._source)  # type: ignore[misc]
                rest = 1 / min(self._source.camera.rate, 10.0) - (time.monotonic() - begin)
                time.sleep(max(rest, 0.01))
        except KeyboardInterrupt:
            pass
        finally:
            self.stop()

    def stop(self) -> None:
        """Close the page."""
        self._server.stop()

    def _add_scene(self) -> None:
        scene, api = self._source.scene, self._server.scene
        if scene is not None:
            vertices = scene.vertices.astype(np.float32)
            colours = material_colours(scene.tags, self._materials)
            for index, tag in enumerate(scene.tags):
                faces = scene.faces[scene.face_tags == index]
                red, green, blue = (int(channel) for channel in colours[index])
                used, corners = np.unique(faces, return_inverse=True)
                api.add_mesh_simple(
                    f"/scene/{tag}", vertices[used], corners.reshape(faces.shape).astype(np.uint32),
                    color=(red, green, blue), flat_shading=True, side="double", opacity=0.55,
                )  # fmt: skip
        path = self._source.positions
        if len(path) > 1:
            segments = np.stack([path[:-1], path[1:]], axis=1).astype(np.float32)
            api.add_line_segments("/path", segments, (255, 140, 0), thickness=3.0, thickness_units="screen")

    def _add_controls(self, first: Shot) -> None:
        gui, camera = self._server.gui, self._source.camera
        gui.configure_theme(control_layout="fixed", dark_mode=True)
        gui.add_markdown(f"**{camera.name}**, {camera.width}x{camera.height}, {len(self._source)} frames")
        self._frame = gui.add_slider("frame", 0, max(len(self._source) - 1, 1), 1, 0)
        self._play = gui.add_checkbox("play", False)
        self._text = gui.add_markdown("")
        self._image = gui.add_image(depth_colours(first.depth, *self._span), label="depth")

        @self._frame.on_update
        def _(_: viser.GuiEvent) -> None:
            self._show(self._frame.value)

        @self._server.on_client_connect
        def _(client: viser.ClientHandle) -> None:
            # Start a little behind and above the camera, looking the way it looks.
            pose = self._source.shot(self._frame.value).pose
            client.camera.position = tuple(pose[:3, 3] - 0.8 * pose[:3, 2] + np.array([0, 0, 0.35]))
            client.camera.look_at = tuple(pose[:3, 3] + pose[:3, 2])

    def _show(self, index: int) -> None:
        """Put one frame on the page."""
        index = min(index, len(self._source) - 1)
        shot, camera = self._source.shot(index), self._source.camera
        step = max(1, int(np.ceil(np.sqrt(np.count_nonzero(shot.depth) / _MOST_POINTS))))
        points, depths = _points(shot, camera.rays, step)
        holes = float((shot.depth == 0).mean())
        thinned = f", 1 point in {step * step} shown" if step > 1 else ""
        with self._lock, self._server.atomic():
            colours = depth_colours(depths, *self._span)
            self._server.scene.add_point_cloud("/cloud", points, colours, point_size=0.008, precision="float32")
            self._server.scene.add_camera_frustum(
                "/camera",
                fov=2 * float(np.arctan(camera.height / 2 / camera.fy)),
                aspect=camera.width / camera.height,
                scale=0.12,
                thickness=2.0,
                thickness_units="screen",
                color=(255, 140, 0),
                wxyz=_wxyz(shot.pose),
                position=tuple(shot.pose[:3, 3]),
            )
            self._image.image = depth_colours(shot.depth, *self._span)
            near, far = self._span
            self._text.content = f"{holes:.1%} holes{thinned}. Colours from {near:.2f} to {far:.2f} m."


def _points(shot: Shot, rays: NDArray[np.float32], step: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(N, 3) world points of the returns and (N,) their depths; every ``step``th row and column."""
    depth = shot.depth[::step, ::step]
    hit = depth > 0
    z = depth[hit]
    local = np.stack([rays[0, ::step, ::step][hit] * z, rays[1, ::step, ::step][hit] * z, z], axis=1)
    return (local @ shot.pose[:3, :3].T + shot.pose[:3, 3]).astype(np.float32), z


def _wxyz(pose: NDArray[np.float64]) -> tuple[float, float, float, float]:
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
    return float(w), float(x), float(y), float(z)
