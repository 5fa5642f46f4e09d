"""A sensor profile: which camera, and which effects with which parameters."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel, ConfigDict

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.presets import resolve_camera
from depthsim.registry import VARIABLE
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.sensor.parameter import learned_of
from depthsim.stereo.settings import ActiveStereo, split_camera
from depthsim.yamlfile import read_mapping, validate

_CAUSE_KEYS = ("effect", "parameters", "ci95", "closed_fraction", "ci95_closed", "indistinguishable_from")
"""The keys of a cause in diagnosis.json, which may be pasted into a profile."""


class Profile(BaseModel):
    """A camera, where the profile names one, and effects in the order of the file.

    stereo: what active stereo is made of, where depth comes from it; the effects follow after.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)

    name: str
    camera: Camera | None = None
    effects: tuple[Effect, ...] = ()
    stereo: ActiveStereo | None = None

    def to_yaml(self) -> str:
        """The text of a profile file that :func:`load_profile` reads back as this profile."""
        keys: dict[str, Any] = {"name": self.name}
        if self.camera is not None:
            keys["camera"] = yaml.safe_load(self.camera.to_yaml())
        if self.stereo is not None:
            keys["camera"] = {**self.stereo.camera_keys(), **keys.get("camera", {})}
        keys["effects"] = [{effect.id: _keys_of(effect)} for effect in self.effects]
        return yaml.dump(keys, Dumper=_Dumper, sort_keys=False)


class _Row(list[float]):
    """Numbers that stand in one line of a file."""


class _Dumper(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        return super().ignore_aliases(data) or isinstance(data, _Row)


_Dumper.add_representer(
    _Row, lambda dumper, row: dumper.represent_sequence("tag:yaml.org,2002:seq", row, flow_style=True)
)


def _keys_of(effect: Effect) -> dict[str, Any]:
    """An effect's parameters as a file has them; a table that is not there is left out."""
    keys = effect.model_dump(mode="json")
    for name in learned_of(type(effect)):
        table = keys.pop(name)
        if table is not None:
            keys[name] = [_Row(row) for row in table]
    return keys


def load_profile(choice: str | Path | Profile | Sequence[Effect]) -> Profile:
    """Read a profile: the name of one that comes with depthsim (``paper``), or the path of a YAML file.

    A :class:`Profile` stays as it is; of effects alone one is made. In a file an entry of ``effects`` is an id
    alone, which has its default parameters, or ``id: {parameter: value}``.
    """
    if isinstance(choice, Profile):
        return choice
    if not isinstance(choice, str | Path):
        return Profile(name="effects", effects=tuple(choice))
    path = profile_path(choice)
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
    camera, stereo = split_camera(keys.get("camera"), path)
    name = str(keys.get("name") or path.stem)
    return Profile(name=name, camera=_camera(camera, path), effects=effects, stereo=stereo)


def profile_names() -> list[str]:
    """The profiles that come with depthsim."""
    return sorted(path.stem for path in _folder().glob("*.yaml"))


def _folder() -> Path:
    return Path(__file__).resolve().parent / "profiles"


def profile_path(choice: str | Path) -> Path:
    """The file of a profile, as :func:`load_profile` finds it."""
    if str(choice) in profile_names():  # first, because a run's folder has a folder `clean`
        return _folder() / f"{choice}.yaml"
    path = Path(choice)
    if path.suffix in (".yaml", ".yml") or os.path.exists(path):  # which, unlike Path's, takes any text
        return path
    raise InputError(choice, "", "is no sensor profile", f"give a YAML file or one of {', '.join(profile_names())}")


def _camera(value: Any, path: Path) -> Camera | None:
    return None if value is None else resolve_camera(value, path)


def _effect(entry: Any, path: Path, place: str) -> Effect:
    """An effect from `id`, `{id: {…}}` or `{effect: id, parameters: {…}}`, the form of diagnosis.json."""
    parameters: Any = None
    if isinstance(entry, str):
        effect_id = entry
    elif isinstance(entry, dict) and isinstance(entry.get("effect"), str):
        unknown = [key for key in entry if key not in _CAUSE_KEYS]
        if unknown:
            raise InputError(path, f"{place}.{unknown[0]}", "is not a key of an effect", "write effect and parameters")
        effect_id, parameters = entry["effect"], entry.get("parameters")
    elif isinstance(entry, dict) and len(entry) == 1:
        effect_id, parameters = next(iter(entry.items()))
    else:
        raise InputError(path, place, "is not an effect", "write `- id` or `- id: {parameter: value}`")
    if effect_id not in effect_ids():
        fix = f"the effects are {', '.join(effect_ids())}, and those of the files that {VARIABLE} names"
        raise InputError(path, place, f"there is no effect {effect_id!r}", fix)
    parameters = {} if parameters is None else parameters
    if not isinstance(parameters, dict):
        raise InputError(path, f"{place}.{effect_id}", "has no parameters by name", "write {parameter: value}")
    return validate(effect_class(effect_id), parameters, path, f"{place}.{effect_id}")
