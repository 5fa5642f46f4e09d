"""A sensor profile: which camera, and which effects with which parameters."""

from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.yamlfile import read_mapping, validate


class Profile(BaseModel):
    """A camera, where the profile names one, and effects in the order of the file."""

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    name: str
    camera: Camera | None = None
    effects: tuple[Effect, ...] = ()

    def to_yaml(self) -> str:
        """The text of a profile file that :func:`load_profile` reads back as this profile."""
        keys: dict[str, Any] = {"name": self.name}
        if self.camera is not None:
            keys["camera"] = yaml.safe_load(self.camera.to_yaml())
        keys["effects"] = [{effect.id: effect.model_dump(mode="json")} for effect in self.effects]
        return yaml.safe_dump(keys, sort_keys=False)


def load_profile(choice: str | Path) -> Profile:
    """Read a profile: the name of one that comes with depthsim (``paper``), or the path of a YAML file.

    An entry of ``effects`` is an id alone, which has its default parameters, or ``id: {parameter: value}``.
    """
    path = _find(choice)
    keys = read_mapping(path, "a sensor profile")
    unknown = [key for key in keys if key not in ("name", "camera", "effects", "description")]
    if unknown:
        raise InputError(
            path, unknown[0], "is not a key of a profile", "the keys are name, camera, effects, description"
        )
    entries = keys.get("effects")
    if entries is None:
        entries = []
    if not isinstance(entries, list):
        raise InputError(path, "effects", "is not a list", "write one `- effect_id` a line; [] for a perfect camera")
    effects = tuple(_effect(entry, path, f"effects[{index}]") for index, entry in enumerate(entries))
    return Profile(name=str(keys.get("name") or path.stem), camera=_camera(keys.get("camera"), path), effects=effects)


def profile_names() -> list[str]:
    """The profiles that come with depthsim."""
    return sorted(path.stem for path in _folder().glob("*.yaml"))


def _folder() -> Path:
    return Path(__file__).resolve().parent / "profiles"


def _find(choice: str | Path) -> Path:
    path = Path(choice)
    built_in = _folder() / f"{choice}.yaml"
    if path.suffix in (".yaml", ".yml") or path.exists():
        return path
    if built_in.parent == _folder() and built_in.is_file():
        return built_in
    raise InputError(choice, "", "is no sensor profile", f"give a YAML file or one of {', '.join(profile_names())}")


def _camera(value: Any, path: Path) -> Camera | None:
    from depthsim.presets import resolve_camera

    return None if value is None else resolve_camera(value, path)


def _effect(entry: Any, path: Path, place: str) -> Effect:
    """An effect from `id`, `{id: {…}}` or `{effect: id, parameters: {…}}`, the form of diagnosis.json."""
    parameters: Any = {}
    if isinstance(entry, str):
        effect_id = entry
    elif isinstance(entry, dict) and isinstance(entry.get("effect"), str):
        effect_id, parameters = entry["effect"], entry.get("parameters") or {}
    elif isinstance(entry, dict) and len(entry) == 1:
        effect_id, parameters = next(iter(entry.items()))
        parameters = parameters or {}
    else:
        raise InputError(path, place, "is not an effect", "write `- id` or `- id: {parameter: value}`")
    if effect_id not in effect_ids():
        raise InputError(path, place, f"there is no effect {effect_id!r}", f"the effects are {', '.join(effect_ids())}")
    if not isinstance(parameters, dict):
        raise InputError(path, f"{place}.{effect_id}", "has no parameters by name", "write {parameter: value}")
    return validate(effect_class(effect_id), parameters, path, f"{place}.{effect_id}")
