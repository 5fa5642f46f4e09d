"""The viewer: a page in the browser that shows a scene or a run as mesh, camera and point cloud."""

from viewer.app import Viewer
from viewer.source import RunSource, SceneSource, Shot

__all__ = ["RunSource", "SceneSource", "Shot", "Viewer"]
