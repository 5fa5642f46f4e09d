"""Reading scenes: OBJ, GLB, glTF, PLY, STL, OFF, and scene files that place several of them."""

from depthsim.scenefile.load import load_scene
from depthsim.scenefile.locate import builtin_scenes

__all__ = ["builtin_scenes", "load_scene"]
