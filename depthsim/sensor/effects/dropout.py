"""Holes that depend on the surface: its slant, its range, its material, and its gloss."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, FiniteFloat

from depthsim.draws import BLOCK
from depthsim.kernels import kernel
from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame
from depthsim.sensor.holes import lose
from depthsim.sensor.parameter import Setting, by_material, parameters_of

_f = np.float32
_ZERO, _ONE = _f(0), _f(1)


@kernel
def _lose_by_cosine(start, stop, frame, key, rate, limit, cosine, depth):
    words, uniforms, chance = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        z, c = depth[at : min(at + BLOCK, stop)], cosine[at : min(at + BLOCK, stop)]
        for i in range(z.size):
            chance[i] = rate * (_ONE - c[i] / limit) if z[i] > _ZERO else _ZERO
        lose(at // BLOCK, frame, key, chance, words, uniforms, z)


@kernel
def _lose_by_range(start, stop, frame, key, rate, begin, clean, depth):
    words, uniforms, chance = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        z, d = depth[at : min(at + BLOCK, stop)], clean[at : min(at + BLOCK, stop)]
        for i in range(z.size):
            chance[i] = rate * (d[i] - begin)
        lose(at // BLOCK, frame, key, chance, words, uniforms, z)


@kernel
def _lose_by_tag(start, stop, frame, key, chance_of_tag, tag, depth):
    words, uniforms, chance = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        z, t = depth[at : min(at + BLOCK, stop)], tag[at : min(at + BLOCK, stop)]
        for i in range(z.size):
            chance[i] = chance_of_tag[t[i]]
        lose(at // BLOCK, frame, key, chance, words, uniforms, z)


@kernel
def _lose_by_mirror(start, stop, frame, key, chance_of_tag, sine2, tag, cosine, depth):
    words, uniforms, chance = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        end = min(at + BLOCK, stop)
        z, t, c = depth[at:end], tag[at:end], cosine[at:end]
        for i in range(z.size):
            lobe = max(_ONE - (_ONE - c[i] * c[i]) / sine2, _ZERO)
            chance[i] = min(chance_of_tag[t[i]] * lobe * lobe, _ONE)
        lose(at // BLOCK, frame, key, chance, words, uniforms, z)


class IncidenceDropout(Effect):
    """Holes at grazing angles: chance = rate · (1 - cos θ / cos start) beyond ``start``, at most 1; θ the angle of
    incidence.

    A slanted surface sends back less of the projector's light, and its pattern is squeezed in one of the images.
    """

    id: ClassVar[str] = "incidence_dropout"
    stage: ClassVar[Stage] = Stage.HOLES
    source: ClassVar[str] = "form assumed: linear in the cosine, as the light is that a matt surface catches"
    axes = ("incidence", "surface")
    kinds = ("missing",)
    recording = "one wall at one range under many angles"

    start: float = parameter(
        70.0,
        low=0,
        high=90,
        unit="deg",
        neutral=90,
        about="angle from which on there are holes",
        source="assumed",
        starts=(30, 55, 75),
    )
    rate: float = parameter(
        1.0,
        low=0,
        high=4,
        unit="share",
        neutral=0,
        about="share of holes where the ray grazes, at 90°; above 1 all is lost before that",
        source="assumed",
        starts=(0.5,),
    )

    def apply(self, frame: Frame) -> None:
        """Set the drawn pixels to 0."""
        draws, limit = frame.draws(self.id), _f(np.cos(np.radians(self.start)))
        cosine = frame.geometry.cosine.reshape(-1)
        frame.run(
            _lose_by_cosine, draws.frame, draws.key, _f(self.rate), limit, cosine, frame.depth.reshape(-1),
            multiple=BLOCK,
        )  # fmt: skip


class RangeDropout(Effect):
    """Holes that grow with range: chance = rate · (z - start) beyond ``start``, z the true depth."""

    id: ClassVar[str] = "range_dropout"
    stage: ClassVar[Stage] = Stage.HOLES
    source: ClassVar[str] = "form assumed: linear; the projector's light falls off with the square of the range"
    axes = ("range",)
    kinds = ("missing",)
    recording = "one material out to ranges where holes begin"
    outgrown: ClassVar = {"rate": 1.5}  # where all are lost within decimetres is a limit of the range

    start: float = parameter(
        3.0,
        low=0,
        high=30,
        unit="m",
        about="range up to which there are no holes",
        source="D435 product page: ideal to 3 m",
        starts=lambda seen: seen.depths(0.06, 0.5),
        scale="range",
    )
    rate: float = parameter(
        0.05,
        low=0,
        high=2,
        unit="1/m",
        neutral=0,
        about="share of holes added per metre beyond",
        source="assumed",
        starts=(0.05,),
    )

    def apply(self, frame: Frame) -> None:
        """Set the drawn pixels to 0."""
        draws, clean = frame.draws(self.id), frame.geometry.depth.reshape(-1)
        frame.run(
            _lose_by_range, draws.frame, draws.key, _f(self.rate), _f(self.start), clean, frame.depth.reshape(-1),
            multiple=BLOCK,
        )  # fmt: skip


class MaterialDropout(Effect):
    """Holes on some materials: chance = rates[tag], else rate · (1 - reflectance / dark) where it is darker than that.

    The reflectance is materials.yaml's ``ir_reflectance``. So by default black and clear things have holes, and a
    profile can name materials of its own.
    """

    id: ClassVar[str] = "material_dropout"
    stage: ClassVar[Stage] = Stage.HOLES
    source: ClassVar[str] = "form assumed: what scatters little of the projector's light shows no pattern to match"
    axes = ("material", "surface")
    kinds = ("missing",)
    recording = "the same range and angle on several materials"
    forms = ({"rate": 0.0},)  # by tag alone: materials.yaml's reflectances are known

    rate: float = parameter(
        0.8,
        low=0,
        high=1,
        unit="share",
        neutral=0,
        about="share of holes on a material that scatters nothing",
        source="assumed",
        frozen=True,
    )
    dark: float = parameter(
        0.1,
        low=1e-3,
        high=1,
        unit="1",
        about="infrared reflectance from which on there are no holes",
        source="assumed",
        frozen=True,
    )
    rates: dict[str, Annotated[FiniteFloat, Field(ge=0, le=1)]] = by_material(
        about="share of holes on some tags, in place of what their reflectance gives",
        unit="share",
        source="none by default",
        step=0.02,
        starts=(0.02,),
    )

    @property
    def material_tags(self) -> tuple[str, ...]:
        """The tags that have a rate of their own here."""
        return tuple(self.rates)

    @property
    def is_neutral(self) -> bool:
        """Whether it makes no holes, neither by reflectance nor by tag."""
        return self.rate == 0 and not any(self.rates.values())

    def apply(self, frame: Frame) -> None:
        """Set the drawn pixels to 0."""
        draws = frame.draws(self.id)
        known = {tag: self.rate * (1 - frame.materials[tag].ir_reflectance / self.dark) for tag in frame.scene.tags}
        chance, tag = frame.by_tag(known | self.rates), frame.geometry.tag.reshape(-1)
        frame.run(_lose_by_tag, draws.frame, draws.key, chance, tag, frame.depth.reshape(-1), multiple=BLOCK)


class SpecularDropout(Effect):
    """Holes where a glossy surface mirrors the projector into the imager: chance = rate · share · (1 - s²)², at most 1.

    s = sin θ / sin width, θ the angle of incidence: the projector stands so close to the imager that the mirror's place
    is where the surface is met square on. share = gloss / (gloss + ir_reflectance) is the part of the returned light
    that was mirrored, 0 for materials of at most ``matt`` gloss; both are from materials.yaml.
    """

    id: ClassVar[str] = "specular_dropout"
    stage: ClassVar[Stage] = Stage.HOLES
    source: ClassVar[str] = "form assumed: a lobe about the mirror direction, where the imager saturates"
    axes = ("incidence", "material", "surface")
    kinds = ("missing",)
    recording = "a glossy surface seen straight on and at a slant"
    forms = ({"gloss": {}},)

    rate: float = parameter(
        1.0,
        low=0,
        high=20,
        unit="share",
        neutral=0,
        about="share of holes in the middle of a mirror; above 1, as many where that much less is mirrored",
        source="assumed",
        starts=(0.6, 4.0),
        scale="log",
    )
    width: float = parameter(
        15.0,
        low=0,
        high=90,
        unit="deg",
        neutral=0,
        about="angle of incidence where it ends",
        source="assumed",
        starts=(10, 30),
    )
    matt: float = parameter(
        0.05,
        low=0,
        high=1,
        unit="1",
        about="gloss up to which there are no holes",
        source="materials.yaml: 0.05 is nearly matt",
        frozen=True,
    )
    gloss: dict[str, Annotated[FiniteFloat, Field(ge=0, le=1)]] = by_material(
        about="gloss of some tags, in place of materials.yaml's", unit="1", source="materials.yaml", step=0.05
    )

    @property
    def material_tags(self) -> tuple[str, ...]:
        """The tags that have a gloss of their own here."""
        return tuple(self.gloss)

    @classmethod
    def forms_in(cls, setting: Setting) -> Sequence[Mapping[str, Any]]:
        """All shiny materials as materials.yaml has them, or one of them alone: what a table says of a kind of material
        is not so of every one."""
        matt = parameters_of(cls)["matt"].default
        shiny = [tag for tag in setting.tags if setting.materials[tag].gloss > matt]
        alone = ({"gloss": {other: 0.0 for other in shiny if other != tag}} for tag in shiny)
        return (*cls.forms, *(alone if len(shiny) > 1 else ()))

    def apply(self, frame: Frame) -> None:
        """Set the drawn pixels to 0."""
        draws = frame.draws(self.id)
        chance = frame.by_tag({tag: self._chance(frame, tag) for tag in frame.scene.tags})
        sine2 = _f(max(np.sin(np.radians(self.width)) ** 2, 1e-12))
        tag, cosine = frame.geometry.tag.reshape(-1), frame.geometry.cosine.reshape(-1)
        frame.run(
            _lose_by_mirror, draws.frame, draws.key, chance, sine2, tag, cosine, frame.depth.reshape(-1),
            multiple=BLOCK,
        )  # fmt: skip

    def _chance(self, frame: Frame, tag: str) -> float:
        material = frame.materials[tag]
        gloss = self.gloss.get(tag, material.gloss)
        return self.rate * gloss / (gloss + material.ir_reflectance) if gloss > self.matt else 0
