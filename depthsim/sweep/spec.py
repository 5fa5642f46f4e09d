"""The keys of a SWEEP.yaml."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator

from depthsim.scenefile.spec import Axis, TagMap, Unit
from depthsim.sweep.draw import Distribution
from depthsim.yamlfile import read_model

Stream = Literal["depth", "clean", "material", "rgb", "normal", "instance", "ir_left", "ir_right"]


def _as_entry(value: Any) -> Any:
    return {"scene": value} if isinstance(value, str) else value


def _as_choice(value: Any) -> Any:
    return {"choice": value} if isinstance(value, list) else value


MOST_SEEDS = 1_000_000
"""The plan lists the seeds, so their number has to have a bound."""

Drawn = dict[str, Distribution]
Choice = Annotated[Distribution, BeforeValidator(_as_choice)]


class SceneEntry(BaseModel):
    """A scene by name or file, as ``depthsim generate`` takes it, and what is given for it alone."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    scene: str = Field(
        min_length=1, description="a built-in scene, or a file in this file's folder; * and ? match many"
    )
    tags: TagMap = Field({}, description="material tags by the mesh's material names")
    units: Unit | None = None
    up: Axis | None = None
    trajectories: tuple[str | dict[str, Any], ...] | None = Field(None, description="in place of the sweep's")


class Random(BaseModel):
    """What every draw draws anew. A range under a profile, a tag or a shape that lacks it does nothing there."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    effects: dict[str, Drawn] = Field({}, description="effect: {parameter: distribution}, where the profile has it")
    stereo: dict[str, Drawn] = Field({}, description="part of active stereo: {key: distribution}")
    light: dict[Literal["azimuth", "elevation", "sun", "ambient"], Distribution] = Field(
        {}, description="of ambient_light and active stereo [deg]; sun and ambient of active stereo alone [W/m²]"
    )
    materials: dict[str, Choice] = Field({}, description="tag: the tags to put in its place")
    surfaces: dict[str, Drawn] = Field({}, description="tag: {key of materials.yaml: distribution}")
    trajectory: Drawn = Field({}, description="key of a shape, such as speed: distribution")

    def paths(self) -> dict[str, Distribution]:
        """All distributions by their dotted place, such as ``effects.fill_rate.rate``."""
        found: dict[str, Distribution] = {}
        for group in ("effects", "stereo", "surfaces"):
            for name, keys in getattr(self, group).items():
                found |= {f"{group}.{name}.{key}": drawn for key, drawn in keys.items()}
        for group in ("light", "materials", "trajectory"):
            found |= {f"{group}.{name}": drawn for name, drawn in getattr(self, group).items()}
        return found


class SweepFile(BaseModel):
    """A sweep: every scene x trajectory x profile x seed x draw is a run."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = ""
    description: str = ""
    scenes: tuple[Annotated[SceneEntry, BeforeValidator(_as_entry)], ...] = Field(min_length=1)
    trajectories: tuple[str | dict[str, Any], ...] | None = Field(None, description="each scene's first if left out")
    profiles: tuple[str, ...] = Field(("paper",), min_length=1)
    seeds: int | tuple[int, ...] = Field(1, description="how many (0, 1, ...), or which")
    draws: int = Field(1, ge=1, le=10_000_000, description="random draws of each combination")
    seed: int = Field(0, description="of the draws and the noise of the whole sweep")
    camera: str | dict[str, Any] | None = Field(None, description="in place of the profiles' cameras")
    resolution: tuple[int, int] | None = Field(None, description="of a preset [px]")
    rate: FiniteFloat | None = Field(None, gt=0, description="in place of the camera's [Hz]")
    frames: int | None = Field(None, ge=1, description="at most so many a run")
    streams: tuple[Stream, ...] = ("depth", "clean", "material", "rgb")
    materials: str | None = Field(None, description="a materials file in this file's folder")
    with_scene: bool = Field(True, description="every run holds its scene (at a URL, a copy of it)")
    random: Random = Field(default_factory=lambda: Random.model_validate({}))

    @model_validator(mode="after")
    def _lists_are_sound(self) -> "SweepFile":
        if isinstance(self.seeds, int) and self.seeds < 1:
            raise ValueError("seeds is below 1: give how many, or a list of them")
        if isinstance(self.seeds, int) and self.seeds > MOST_SEEDS:
            raise ValueError(f"seeds is over {MOST_SEEDS:,}: a random draw takes less room than a seed, so raise draws")
        if not self.seed_list:
            raise ValueError("seeds is empty")
        for what, items in (("profiles", self.profiles), ("seeds", self.seed_list), ("streams", self.streams)):
            if len(set(items)) < len(items):
                raise ValueError(f"{what} names one of its entries twice")
        if "depth" not in self.streams:
            raise ValueError("streams lack depth, which every run has")
        if self.trajectories == () or any(entry.trajectories == () for entry in self.scenes):
            raise ValueError("trajectories is empty: leave it out for each scene's first")
        return self

    @property
    def seed_list(self) -> tuple[int, ...]:
        """The seeds, each by its number."""
        return tuple(range(self.seeds)) if isinstance(self.seeds, int) else self.seeds


def read_sweep(path: Path) -> SweepFile:
    """Read a SWEEP.yaml; :class:`~depthsim.errors.InputError` says what does not fit."""
    return read_model(SweepFile, path, "a sweep")
