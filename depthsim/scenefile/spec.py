"""The keys of a scene file."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, FiniteFloat, model_validator

from depthsim.yamlfile import read_model, validate

Unit = Literal["m", "cm", "mm", "in", "ft"]
Axis = Literal["z", "y"]

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
"""One unit of length in metres."""


def _as_names(value: Any) -> Any:
    """Keys that YAML takes for numbers, such as the material ids of a PLY, as names."""
    return {str(key): tag for key, tag in value.items()} if isinstance(value, dict) else value


def _as_triple(value: Any) -> Any:
    """One scale as three."""
    return (value, value, value) if isinstance(value, int | float) else value


Triple = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
TagMap = Annotated[dict[str, str], BeforeValidator(_as_names)]


class MeshEntry(BaseModel):
    """One mesh of a scene: a file, or a builder with its parameters, and where to place it.

    It is brought to metres and z up first, then scaled, rotated and translated.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    build: str | None = Field(None, description="the name of a builder in depthsim.procedural")
    parameters: dict[str, Any] = Field({}, description="of the builder")
    file: str | None = Field(None, description="a mesh file in the scene file's folder")
    tags: TagMap = Field({}, description="material tags by the mesh's own material names")
    translate: Triple = Field((0.0, 0.0, 0.0), description="[m]")
    rotate: Triple = Field((0.0, 0.0, 0.0), description="roll, pitch, yaw about fixed x, then y, then z [°]")
    scale: Annotated[Triple, BeforeValidator(_as_triple)] = Field((1.0, 1.0, 1.0), description="number or [x, y, z]")
    units: Unit | None = None
    up: Axis | None = None
    name: str | None = Field(None, description="of the object; made from the file or builder if left out")
    moves: dict[str, Any] | None = Field(None, description="how its frame moves in its parent's; see scenefile.moves")
    parent: str | None = Field(None, description="the name of the mesh that it goes along with")
    parts: list[tuple[str, int]] | None = Field(None, description="the objects in it, each with its number of faces")

    @model_validator(mode="after")
    def _one_source(self) -> "MeshEntry":
        if (self.build is None) == (self.file is None):
            raise ValueError("a mesh is either a `file:` or a `build:`")
        if self.parameters and self.build is None:
            raise ValueError("parameters are for a `build:`, not for a `file:`")
        if 0.0 in self.scale:
            raise ValueError("scale is zero: the mesh would be flat")
        return self


class SceneFile(BaseModel):
    """A scene file. ``units`` and ``up`` are those of its mesh files; builders make metres, z up."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str | None = None
    description: str = ""
    units: Unit | None = None
    up: Axis | None = None
    tags: TagMap = Field({}, description="material tags by material name, for all meshes")
    meshes: list[dict[str, Any]] = Field(min_length=1, description="see MeshEntry")
    trajectories: dict[str, dict[str, Any]] = Field({}, description="trajectory specifications by name")


def read_scene_file(path: Path) -> tuple[SceneFile, list[MeshEntry]]:
    """A scene file and its meshes; :class:`depthsim.errors.InputError` says what does not fit."""
    spec = read_model(SceneFile, path, "a scene file")
    return spec, [validate(MeshEntry, entry, path, f"meshes.{i}") for i, entry in enumerate(spec.meshes)]
