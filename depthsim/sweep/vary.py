"""A draw's values, put in their places: profile, materials, trajectory, and the tags of a scene."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.materials import Material, Materials
from depthsim.scene import Scene
from depthsim.sensor import Profile
from depthsim.sensor.effect import Effect, effect_class, parameters_of
from depthsim.stereo.settings import ActiveStereo
from depthsim.sweep.plan import Plan, PlannedPath, PlannedProfile, PlannedRun, PlannedScene
from depthsim.trajectory import SHAPES, Trajectory
from depthsim.trajectory.motion import Motion
from depthsim.trajectory.spec import parse_spec
from depthsim.yamlfile import validate

Values = Mapping[str, Any]
_SWEEP = Path("sweep")


def varied_profile(planned: PlannedProfile, values: Values) -> Profile:
    """The profile with ``effects.ID.PARAMETER``, ``stereo.PART.KEY`` and ``light.KEY`` set where it has them."""
    effects = tuple(_effect(name, {**keys, **_drawn_of_effect(name, values)}) for name, keys in planned.effects)
    stereo = None
    if planned.stereo is not None:
        parts = {part: dict(keys) for part, keys in planned.stereo.items()}
        for path, value in values.items():
            group, _, rest = path.partition(".")
            part, _, key = rest.partition(".")
            if group == "stereo":
                parts.setdefault(part, {})[key] = value
        parts["light"] = {**parts["light"], **_light(values)}
        stereo = validate(ActiveStereo, parts, _SWEEP, "random.stereo")
    camera = Camera.model_validate(planned.camera)
    return Profile(name=planned.name, camera=camera, effects=effects, stereo=stereo)


def _effect(name: str, keys: dict[str, Any]) -> Effect:
    return validate(effect_class(name), keys, _SWEEP, f"random.effects.{name}")


def _drawn_of_effect(name: str, values: Values) -> dict[str, Any]:
    drawn = {path.split(".")[2]: value for path, value in values.items() if path.startswith(f"effects.{name}.")}
    return {key: values[path] for key, path in _shared(name).items() if path in values} | drawn


def _shared(name: str) -> dict[str, str]:
    """The values of a sweep that an effect's parameters share with other parts of the sensor, by parameter."""
    return {key: one.drawn_as for key, one in parameters_of(effect_class(name)).items() if one.drawn_as}


def _light(values: Values) -> dict[str, Any]:
    """The keys of active stereo's light that ``light.*`` sets."""
    light = {key: values[f"light.{key}"] for key in ("sun", "ambient") if f"light.{key}" in values}
    if "light.azimuth" in values or "light.elevation" in values:
        azimuth, elevation = (np.radians(float(values.get(f"light.{key}", 45))) for key in ("azimuth", "elevation"))
        light["sun_direction"] = tuple(
            float(x)
            for x in (
                np.cos(elevation) * np.cos(azimuth),
                np.cos(elevation) * np.sin(azimuth),
                np.sin(elevation),
            )
        )
    return light


def varied_materials(materials: Materials, values: Values) -> Materials:
    """The materials with ``surfaces.TAG.KEY`` set."""
    drawn: dict[str, dict[str, Any]] = {}
    for path, value in values.items():
        group, _, rest = path.partition(".")
        if group == "surfaces":
            tag, _, key = rest.rpartition(".")
            drawn.setdefault(tag, {})[key] = value
    if not drawn:
        return materials
    changed = {
        tag: validate(Material, {**materials[tag].model_dump(), **keys}, _SWEEP, f"random.surfaces.{tag}")
        for tag, keys in drawn.items()
    }
    return Materials({**materials.root, **changed})


def swaps_of(scene_tags: tuple[str, ...], values: Values) -> dict[str, str]:
    """The tags of a scene that ``materials.TAG`` puts others in place of."""
    drawn = {tag: str(values[f"materials.{tag}"]) for tag in scene_tags if f"materials.{tag}" in values}
    return {tag: other for tag, other in drawn.items() if tag != other}


def swapped_scene(scene: Scene, swaps: Mapping[str, str]) -> Scene:
    """The same triangles, arrays and all, with other tags."""
    if not swaps:
        return scene
    names = [swaps.get(tag, tag) for tag in scene.tags]
    in_use = sorted(set(names))
    index = np.array([in_use.index(name) for name in names], np.uint8)
    changed = replace(scene, face_tags=index[scene.face_tags], tags=tuple(in_use))
    # The geometry is the same, so what was worked out from it is good here as well.
    vars(changed).update({key: vars(scene)[key] for key in ("normals", "areas") if key in vars(scene)})
    return changed


def varied_path(planned: PlannedPath, values: Values) -> Motion | Trajectory:
    """The trajectory with ``trajectory.KEY`` set, where it is a shape that has such a key."""
    if planned.shape is None:
        rows = np.array(planned.poses)
        return Trajectory(rows[:, 0], rows[:, 1:4], rows[:, 4:], planned.name)
    keys = dict(planned.shape)
    drawn = {path.partition(".")[2]: value for path, value in values.items() if path.startswith("trajectory.")}
    keys |= {key: value for key, value in drawn.items() if key in _keys_of(planned)}
    return parse_spec(keys, _SWEEP, "random.trajectory")


def frames_of(path: Motion | Trajectory, rate: float | None, most: int | None) -> int:
    """How many frames a run along ``path`` has: all that fit, and at most ``most``."""
    from depthsim.trajectory.poses import TOLERANCE, frame_count

    if isinstance(path, Motion):
        if rate is None:
            raise InputError("sweep", "rate", "a shape has no frames of its own", "give a frame rate")
        available = frame_count(path.total_time, rate, "trajectory")
    elif rate is None:
        available = len(path)
    else:
        available = frame_count(path.duration + TOLERANCE, rate, path.name)
    return available if most is None else min(available, most)


def _keys_of(planned: PlannedPath) -> set[str]:
    """The keys of a shape; none of recorded poses."""
    return set() if planned.shape is None else set(SHAPES[planned.shape["shape"]].model_fields) - {"shape"}


def is_used(path: str, scene: PlannedScene, trajectory: PlannedPath, profile: PlannedProfile, values: Values) -> bool:
    """Whether the drawn value at ``path`` changes anything in a run of these; ``values`` are all of its draw."""
    group, _, rest = path.partition(".")
    name, _, _ = rest.rpartition(".")
    effects = {effect for effect, _ in profile.effects}
    if group == "effects":
        return name in effects
    if group == "stereo":
        return profile.stereo is not None
    if group == "light":
        return profile.stereo is not None or any(path in _shared(effect).values() for effect in effects)
    if group == "materials":
        return rest in scene.tags
    if group == "surfaces":
        swaps = swaps_of(scene.tags, values)
        return name in {swaps.get(tag, tag) for tag in scene.tags}
    return rest in _keys_of(trajectory)


def values_in_use(plan: Plan, run: PlannedRun) -> dict[str, Any]:
    """Of the values that were drawn for a run, those that change it."""
    scene = plan.scenes[run.scene]
    place = (scene, scene.trajectories[run.trajectory], plan.profiles[run.profile])
    return {path: value for path, value in run.values.items() if is_used(path, *place, run.values)}


def planned_frames(plan: Plan, run: PlannedRun) -> int:
    """How many frames a run has."""
    trajectory = plan.scenes[run.scene].trajectories[run.trajectory]
    path = varied_path(trajectory, run.values)
    return frames_of(path, plan.profiles[run.profile].camera["rate"], plan.frames)
