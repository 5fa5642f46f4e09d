"""The viewer: a page in the browser that shows a scene, a run or a report, and lets one turn the sensor's knobs."""

from viewer.opening import open_stage
from viewer.server import Viewer
from viewer.stage import Stage

__all__ = ["Stage", "Viewer", "open_stage"]
