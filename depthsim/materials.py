"""Materials: what a depth sensor's effects need to know of a surface, by tag."""

from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, RootModel

from depthsim.errors import InputError
from depthsim.resources import resource
from depthsim.yamlfile import read_model


class Material(BaseModel):
    """One entry of materials.yaml. Keys that depthsim does not know are kept for the effects that do."""

    model_config = ConfigDict(extra="allow", frozen=True)

    m: FiniteFloat = Field(ge=0, le=20, description="growth of the depth noise, std = 0.005 m · exp(m·d) [1/m]")
    source: str = Field("", description="where m comes from")
    ir_reflectance: FiniteFloat = Field(0.5, ge=0, le=1, description="diffuse reflectance at 850 nm")
    gloss: FiniteFloat = Field(0.05, ge=0, le=1, description="share of the light that is mirrored")
    transmission: FiniteFloat = Field(0.0, ge=0, le=1, description="share of the sun's light that passes through")
    albedo: FiniteFloat = Field(0.5, ge=0, le=1, description="diffuse reflectance in visible light, for rgb/ images")
    texture: FiniteFloat = Field(0.3, ge=0, le=1, description="contrast of the procedural texture in rgb/ images")
    color: str = Field("#9a9a9a", pattern="^#[0-9a-fA-F]{6}$", description="for pictures only; no effect looks at it")


class Materials(RootModel[dict[str, Material]]):
    """All entries of a materials.yaml, by tag."""

    def __getitem__(self, tag: str) -> Material:
        return self.root[tag]

    def __contains__(self, tag: object) -> bool:
        return isinstance(tag, str) and tag in self.root  # a file's tag may be anything

    @property
    def clear(self) -> frozenset[str]:
        """The tags of what more than half of the sun's light passes, which casts no shadow."""
        return frozenset(tag for tag, material in self.root.items() if material.transmission > 0.5)

    @property
    def tags(self) -> list[str]:
        """The known tags, sorted."""
        return sorted(self.root)


def load_materials(choice: str | Path | Materials | None = None) -> Materials:
    """The materials of a file, or the ones that come with depthsim; :class:`Materials` stay as they are."""
    if isinstance(choice, Materials):
        return choice
    path = Path(choice) if choice is not None else resource("materials.yaml")
    materials = read_model(Materials, path, "a materials file")
    if not materials.root:
        raise InputError(path, "", "names no material", "write entries such as `cement: {m: 0.35, source: ...}`")
    return materials
