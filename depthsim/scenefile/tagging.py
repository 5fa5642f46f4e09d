"""From the material names of meshes to tags of materials.yaml."""

from collections.abc import Mapping

from depthsim.errors import InputError
from depthsim.materials import Materials
from depthsim.scenefile.parts import Part, Parts

NO_MATERIAL = "(none)"
"""How people see and name the faces that have no material."""


def shown(name: str) -> str:
    """A material name as people see it."""
    return name or NO_MATERIAL


def check_maps(scene: Parts, tags: Mapping[str, str], materials: Materials) -> None:
    """Raise :class:`InputError` where a tag map leads to a tag that is not a material; it says which map and where."""
    maps = [(f"`tags` {key}={tag}", tag) for key, tag in tags.items()]
    maps += [(f"{part.place}.tags.{key}", tag) for part in scene.parts for key, tag in part.tags.items()]
    maps += [(f"tags.{key}", tag) for key, tag in scene.tags.items()]
    for place, tag in maps:
        if tag not in materials:
            raise InputError(scene.source, place, f"there is no tag {tag!r}", _known(materials))


def tag_of(name: str, part: Part, scene: Parts, tags: Mapping[str, str], materials: Materials) -> str | None:
    """The tag of a material name, None if there is none.

    The maps are asked in turn: the caller's ``tags``, the mesh's, the scene file's; each first for the name, then for
    ``*``. A name that no map has is its own tag if materials.yaml has it.
    """
    for mapping in (tags, part.tags, scene.tags):
        for key in (name, shown(name), "*"):
            if key in mapping:
                return mapping[key]
    return name if name in materials else None


def unknown_names(scene: Parts, counts: Mapping[str, int], materials: Materials) -> InputError:
    """The error that lists material names without a tag, with their numbers of faces, and the tags to choose from."""
    most_first = sorted(counts.items(), key=lambda entry: (-entry[1], entry[0]))
    listed = [f"{shown(name)} ({count} face{'s' if count > 1 else ''})" for name, count in most_first]
    more = f" and {len(listed) - 10} more" if len(listed) > 10 else ""
    problem = f"material names without a tag: {', '.join(listed[:10])}{more}"
    fix = f"give each one by `tags` NAME=TAG or by `tags:` in a scene file (`*` for all others); {_known(materials)}"
    return InputError(scene.source, "", problem, fix)


def _known(materials: Materials) -> str:
    return f"the tags are {', '.join(materials.tags)}"
