"""Which file a user means by a scene."""

import os
from pathlib import Path

from depthsim.errors import InputError
from depthsim.resources import resource
from depthsim.scenefile.mesh import SUFFIXES

SCENE_SUFFIXES = (".yaml", ".yml")
_IN_A_FOLDER = ("scene.yaml", "scene.obj", "scene.glb", "scene.ply")


def builtin_scenes() -> list[str]:
    """The names of the scenes that come with depthsim."""
    return sorted(path.stem for path in resource("scenes").glob("*.yaml"))


def find_scene(scene: str | Path) -> Path:
    """The file of a built-in scene by its name, of a scene or mesh by its path, or of the scene in a run folder.

    A bare name is a built-in scene if there is one of that name, whatever lies in the working directory.
    """
    path = Path(scene)
    if str(path) == path.stem and path.stem in builtin_scenes():
        return resource("scenes", f"{path.stem}.yaml")
    if os.path.isdir(path):  # which, unlike Path's, takes any text
        for name in _IN_A_FOLDER:
            if (path / name).is_file():
                return path / name
        raise InputError(path, "", "has no scene", "put one of " + ", ".join(_IN_A_FOLDER) + " there, or give a file")
    if not os.path.exists(path):
        known = ", ".join(builtin_scenes())
        raise InputError(path, "", "no such scene", f"give a file, a run folder or one of {known}")
    if path.suffix.lower() not in (*SCENE_SUFFIXES, *SUFFIXES):
        kinds = ", ".join((*SCENE_SUFFIXES, *SUFFIXES))
        raise InputError(path, "", f"is of no known kind ({path.suffix or 'no ending'})", f"the kinds are {kinds}")
    return path
