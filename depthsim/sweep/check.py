"""Whether every draw of a sweep could be made: tried with the extremes of each distribution, before a run is made."""

from pathlib import Path
from typing import Any

from depthsim.errors import InputError
from depthsim.materials import Material, Materials
from depthsim.sensor.effect import effect_class, effect_ids
from depthsim.stereo.settings import ActiveStereo
from depthsim.sweep.plan import Plan
from depthsim.sweep.vary import is_used, varied_materials, varied_path, varied_profile


def check_draws(plan: Plan, file: Path) -> None:
    """Raise :class:`InputError`, naming the place in ``file``, for a distribution that no run has a use for or whose
    extreme a profile, a material or a shape refuses.
    """
    materials = Materials.model_validate(plan.materials)
    for path, drawn in plan.random.items():
        place = f"random.{path}"
        if not _is_used(plan, path, file, materials):
            raise InputError(file, place, "no run of this sweep has that value", "correct the name, or leave it out")
        for value in drawn.extremes:
            try:
                _try(plan, path, value, materials)
            except InputError as error:
                raise InputError(file, place, f"{value!r}: {error.problem}", error.fix) from None


def _try(plan: Plan, path: str, value: Any, materials: Materials) -> None:
    """Put one value where it belongs, wherever that is."""
    values, group = {path: value}, path.partition(".")[0]
    if group == "surfaces":
        varied_materials(materials, values)
    elif group == "materials" and value not in materials:
        raise InputError("", "", "is no material tag", f"the tags are {', '.join(materials.tags)}")
    elif group == "trajectory":
        for scene in plan.scenes:
            for planned in scene.trajectories:
                varied_path(planned, values)
    elif group in ("effects", "stereo", "light"):
        for profile in plan.profiles:
            varied_profile(profile, values)


def _is_used(plan: Plan, path: str, file: Path, materials: Materials) -> bool:
    """Whether there is something in the sweep that the value at ``path`` changes."""
    group, _, rest = path.partition(".")
    name, _, key = rest.rpartition(".")
    if group == "effects":
        _refuse_unknown(file, path, name, effect_ids())
        _refuse_unknown(file, path, key, effect_class(name).model_fields)
    elif group == "stereo":
        _refuse_unknown(file, path, name, ActiveStereo.model_fields)
        _refuse_unknown(file, path, key, type(getattr(ActiveStereo(), name)).model_fields)
    elif group == "surfaces":
        _refuse_unknown(file, path, name, materials.root)
        _refuse_unknown(file, path, key, Material.model_fields)
        # A tag may come into a scene by a swap.
        swapped = (drawn.choice or () for place, drawn in plan.random.items() if place.startswith("materials."))
        if any(name in tags for tags in swapped):
            return True
    return any(
        is_used(path, scene, trajectory, profile, {})
        for scene in plan.scenes
        for trajectory in scene.trajectories
        for profile in plan.profiles
    )


def _refuse_unknown(file: Path, path: str, name: str, known: Any) -> None:
    if name not in known:
        raise InputError(file, f"random.{path}", f"there is no {name!r}", f"give one of {', '.join(known)}")
