"""A sweep that is fixed to the last value: all that a worker on any machine needs, as plain JSON.

The plan holds no list of runs. Run ``k`` is worked out from ``k``, so that a plan of a million runs is as small as one
of ten, and workers are given numbers.
"""

import hashlib
import json
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict

from depthsim.errors import InputError
from depthsim.sweep.draw import Distribution, uniform, word
from depthsim.yamlfile import parse_json

VERSION = 1


class _Planned(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class PlannedPath(_Planned):
    """A trajectory: a shape's keys, or recorded poses as rows of a TUM file (t, x, y, z, qx, qy, qz, qw)."""

    name: str
    shape: dict[str, Any] | None = None
    poses: tuple[tuple[float, ...], ...] | None = None


class PlannedScene(_Planned):
    """A scene. folder: where it lies in the target. digest: of its arrays. sources: sha256 by file, as named."""

    name: str
    folder: str
    digest: str
    faces: int
    tags: tuple[str, ...]
    sources: dict[str, str]
    trajectories: tuple[PlannedPath, ...]


class PlannedProfile(_Planned):
    """A sensor: its camera, its effects as (id, parameters), and the parts of active stereo where it is that."""

    name: str
    sources: dict[str, str]
    camera: dict[str, Any]
    effects: tuple[tuple[str, dict[str, Any]], ...]
    stereo: dict[str, Any] | None = None


@dataclass(frozen=True)
class PlannedRun:
    """One run. scene, trajectory, profile: places in the plan. seed: the sweep's; noise_seed: the run's own.

    values: what was drawn, by dotted place.
    """

    index: int
    scene: int
    trajectory: int
    profile: int
    seed: int
    draw: int
    noise_seed: int
    values: dict[str, Any]

    @property
    def path(self) -> str:
        """The run's folder in the target; a thousand runs share a folder."""
        return f"runs/{self.index // 1000:03d}/{self.index:06d}"


class Plan(_Planned):
    """What a sweep makes, and from what."""

    version: int = VERSION
    depthsim: str
    name: str
    scenes: tuple[PlannedScene, ...]
    profiles: tuple[PlannedProfile, ...]
    seeds: tuple[int, ...]
    draws: int
    seed: int
    frames: int | None
    rate: float | None
    streams: tuple[str, ...]
    materials: dict[str, dict[str, Any]]
    with_scene: bool
    random: dict[str, Distribution]

    def __len__(self) -> int:
        return self._starts[-1] * self._each

    @cached_property
    def _starts(self) -> list[int]:
        """The number of trajectories before each scene, and of all."""
        return [0, *accumulate(len(scene.trajectories) for scene in self.scenes)]

    @property
    def _each(self) -> int:
        """The runs of one trajectory."""
        return len(self.profiles) * len(self.seeds) * self.draws

    def runs_of(self, scene: int) -> range:
        """The runs of a scene."""
        return range(self._starts[scene] * self._each, self._starts[scene + 1] * self._each)

    def run(self, index: int) -> PlannedRun:
        """Run ``index``. Scenes come one after another, so that a worker holds few of them at a time.

        A draw's values and noise depend on scene, trajectory, seed and draw, and not on the profile: sensors are
        compared on the same worlds.
        """
        if not 0 <= index < len(self):
            raise IndexError(f"run {index} of {len(self)}")
        number, rest = divmod(index, self._each)
        scene = bisect_right(self._starts, number) - 1
        trajectory = number - self._starts[scene]
        rest, draw = divmod(rest, self.draws)
        profile, place = divmod(rest, len(self.seeds))
        world = (self.seed, self.scenes[scene].name, self.scenes[scene].trajectories[trajectory].name)
        names = (*world, self.seeds[place], draw)
        values = {path: drawn.value(uniform(*names, path)) for path, drawn in self.random.items()}
        noise = word(*names, "noise") >> 33  # 31 bits, which every reader of run.yaml holds
        return PlannedRun(index, scene, trajectory, profile, self.seeds[place], draw, noise, values)

    def to_json(self) -> str:
        """The text of plan.json; the same plan is the same text."""
        return json.dumps(self.model_dump(mode="json"), indent=1, ensure_ascii=False) + "\n"

    @classmethod
    def from_json(cls, text: str, file: str | Path) -> "Plan":
        """The plan in the text of plan.json; ``file`` is what errors call it."""
        try:
            return cls.model_validate(parse_json(text))
        except ValueError as error:
            problem = f"is no plan of a sweep ({str(error).splitlines()[0]})"
            raise InputError(
                file, "", problem, "give another `target`; what this target holds cannot be continued"
            ) from None

    @cached_property
    def digest(self) -> str:
        """sha256 of :meth:`to_json`."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()


_KEEP = "; put it back to finish this sweep, or give another `target` for a new one"


def refuse_changed(old: Plan, new: Plan, target: str) -> None:
    """Raise :class:`InputError` where what is asked for is not what the target was begun with, with the reason."""
    if old.digest == new.digest:
        return
    if old.depthsim != new.depthsim:
        problem = f"was begun by depthsim {old.depthsim}, this is {new.depthsim}"
        raise InputError(target, "", problem, "finish it by that version, or give another `target`")
    for what in ("scenes", "profiles"):
        before, now = ({item.name: item for item in getattr(plan, what)} for plan in (old, new))
        if list(before) == list(now):
            for name in before:
                _refuse_item(what[:-1], before[name], now[name], target)
    for key in Plan.model_fields:
        one, other = (plan.model_dump(mode="json")[key] for plan in (old, new))
        if key in ("scenes", "profiles"):
            one, other = ([item["name"] for item in items] for items in (one, other))
        if one != other:
            problem = f"{key} is {_short(one)} in this target, but {_short(other)} is asked for"
            raise InputError(target, "", problem, _KEEP[2:])


def _refuse_item(what: str, old: Any, new: Any, target: str) -> None:
    """The same for one scene or profile."""
    if old == new:
        return
    for file in sorted({*old.sources, *new.sources}):
        if old.sources.get(file) != new.sources.get(file):
            how = "is new" if file not in old.sources else "is gone" if file not in new.sources else "has changed"
            problem = f"{file} {how} since the sweep was begun"
            raise InputError(target, f"{what} {old.name}", problem, _KEEP[2:])
    keys = [key for key in type(old).model_fields if getattr(old, key) != getattr(new, key)]
    raise InputError(target, f"{what} {old.name}", f"its {keys[0]} differs from when the sweep was begun", _KEEP[2:])


def _short(value: Any) -> str:
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "..."
