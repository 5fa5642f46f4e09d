"""What an effect is, and the registry that simulator, profiles, viewer and diagnosis read.

An effect is one thing, used twice: what the simulator applies to a clean frame, and the hypothesis that the diagnosis
fits to a real one. Its class says all that is to be known of it; nothing else has a list of effects. The registry finds
the classes in ``depthsim/sensor/effects/`` and those in the files that ``DEPTHSIM_EFFECTS`` names.
"""

from collections.abc import Collection, Mapping, Sequence
from enum import IntEnum
from functools import cache
from typing import Any, ClassVar, Literal, get_args

from pydantic import BaseModel, ConfigDict

from depthsim.camera import Camera
from depthsim.registry import check_words, fault, load_own, load_package, with_ids
from depthsim.sensor.frame import Frame
from depthsim.sensor.parameter import Setting, parameter, parameters_of
from depthsim.sensor.view import View

__all__ = ["Axis", "Effect", "Kind", "Setting", "Stage", "effect_class", "effect_ids", "parameter", "parameters_of"]

Axis = Literal[
    "range", "incidence", "material", "surface", "height", "image_row", "image_column", "image_radius",
    "image_position", "edge_distance", "disparity_phase", "time", "motion", "pixel_neighbours", "frame_neighbours",
    "residual_tail",
]  # fmt: skip
"""The axes that the diagnosis cuts a gap along."""
Kind = Literal["bias", "spread", "missing", "correlation", "tail"]
"""In what way simulation and recording may differ."""


class Stage(IntEnum):
    """Where in the sensor an effect acts. Effects run in this order, whatever the order in the profile."""

    POSE = 0
    """the poses that the frame is cast from"""
    OPTICS = 1
    """the directions of the rays"""
    DISPARITY = 2
    """systematic errors of the disparity"""
    NOISE = 3
    """random errors of disparity or depth"""
    MIXING = 4
    """depths that come from a neighbour's surface"""
    HOLES = 5
    """pixels that become holes"""
    MISSING = 5
    """the former name of HOLES, for effects that were written by it"""
    PROCESSING = 6
    """what is done to the finished picture, which has whole units"""


class Effect(BaseModel):
    """One physical effect of a depth sensor, with its parameters as fields.

    A subclass sets ``id``, ``stage``, ``source``, ``axes``, ``kinds`` and ``recording``, declares its parameters with
    :func:`parameter`, and acts in :meth:`apply`, or in :meth:`bend` where the rays themselves are others. An effect
    whose parameters are all neutral is left out of the sensor and so changes not one bit.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: ClassVar[str]
    stage: ClassVar[Stage]
    source: ClassVar[str]
    axes: ClassVar[tuple[Axis, ...]]
    """along which the gap that it makes changes, the one that shows it best first; none where it is alike everywhere"""
    kinds: ClassVar[tuple[Kind, ...]]
    """of gap that it makes, its own first and then those that it may look like"""
    recording: ClassVar[str]
    """what to record to distinguish it from others"""
    rank: ClassVar[int] = 0
    """the order within a stage; effects of one rank act in the order of their ids"""
    needs_right: ClassVar[bool] = False
    """whether the effect asks what the right imager sees"""
    moves_camera: ClassVar[bool] = False
    """whether the pictures that it leaves are of another camera beside: it also acts in :meth:`bend`, at any stage"""
    exact: ClassVar[bool] = False
    """whether it is geometry, of which there is no other formula"""
    law: ClassVar[str] = ""
    """what it is a law of, where a sensor has one such law: a fit tries it beside and in place of another one"""
    forms: ClassVar[tuple[Mapping[str, Any], ...]] = ({},)
    """the forms that it may have, each by the parameters that are held: a fit tries each of them; of an effect that the
    simulator has only those that hold what there is for each material, as it is there"""
    spare_forms: ClassVar[tuple[Mapping[str, Any], ...]] = ()
    """forms that are tried only in place of one that comes near, and is refused"""
    gain_of_material: ClassVar[str] = ""
    """a parameter with a value for each material that does the same at any range: alike for all it is no material's"""
    shown: ClassVar[Mapping[str, float]] = {}
    """other values than the defaults, at which a single picture shows what it does"""
    inseparable: ClassVar[bool] = False
    """whether it makes all of its kinds wherever it makes one"""
    besides: ClassVar[tuple[str, ...]] = ()
    """parameters of errors beside those that it is known by, which without these are another's"""
    outgrown: ClassVar[Mapping[str, float]] = {}
    """values of parameters from which on it is another effect"""
    seen_on: ClassVar[tuple[str, ...]] = ()
    """effects without which it does nothing, such as a noise that it changes"""

    def bend(self, view: View) -> None:
        """Change what the frame is cast with; for the stages POSE and OPTICS."""
        raise NotImplementedError

    def apply(self, frame: Frame) -> None:
        """Change ``frame`` in place; for every later stage."""
        raise NotImplementedError

    def stored(self, camera: Camera) -> Camera:
        """The camera of the pictures that the effect leaves of those of ``camera``: another where it resizes them.

        Of an aligned camera the colour pictures stay; it is the depth before that which is resized.
        """
        return camera

    def imager(self, camera: Camera) -> Camera:
        """The camera whose pictures the effect makes into those of ``camera``: what undoes :meth:`stored`.

        An aligned camera is one before the alignment, too, as sensors take it.
        """
        return camera

    @classmethod
    def resizes(cls) -> bool:
        """Whether its pictures are those of another camera than the one before it."""
        return cls.stored is not Effect.stored

    @classmethod
    def thawed_in(cls, setting: Setting) -> Collection[str]:
        """Of its frozen parameters those that this recording shows, so that fits vary them all the same."""
        return ()

    @classmethod
    def forms_in(cls, setting: Setting) -> Sequence[Mapping[str, Any]]:
        """:attr:`forms`, or those that the recording shows without a fit."""
        return cls.forms

    @classmethod
    def suggested(cls, setting: Setting) -> Sequence[Mapping[str, float]]:
        """Values of all parameters that a recording itself suggests: fits begin there first."""
        return ()

    @classmethod
    def bounds_in(cls, setting: Setting) -> Mapping[str, tuple[float, float]]:
        """Between which values a parameter is, where a recording shows that without a fit."""
        return {}

    @classmethod
    def possible(cls, setting: Setting) -> bool:
        """Whether a recording like this may be of a sensor that has the effect: fits leave it out otherwise."""
        return True

    @property
    def material_tags(self) -> tuple[str, ...]:
        """The tags that the parameters name; the sensor checks that there are such materials."""
        return ()

    @property
    def looks_back(self) -> int:
        """How many frames before its own the effect asks for, by :meth:`Frame.earlier`."""
        return 0

    @property
    def is_neutral(self) -> bool:
        """Whether the effect does nothing because any one of its parameters has its neutral value."""
        return any(
            one.neutral is not None and getattr(self, one.name) == one.neutral
            for one in parameters_of(type(self)).values()
        )


def physical_order(effect: Effect | type[Effect]) -> tuple[int, int, str]:
    """Where an effect comes in the physical order: sort by this."""
    return int(effect.stage), effect.rank, effect.id


@cache
def _registry() -> dict[str, type[Effect]]:
    load_package("depthsim.sensor.effects")
    load_own()
    found = with_ids(Effect, ("stage", "source", "axes", "kinds", "recording"))
    for kind in found.values():
        _check(kind)
    return dict(sorted(found.items(), key=lambda item: physical_order(item[1])))


def _check(kind: type[Effect]) -> None:
    """Raise :class:`InputError` for what a fit, a page or a slider could not make sense of."""
    check_words(kind, "axes", get_args(Axis))
    check_words(kind, "kinds", get_args(Kind))
    if not kind.kinds:
        raise fault(kind, "`kinds` is empty", f"name the kind of gap that it makes: {', '.join(get_args(Kind))}")
    try:
        names = parameters_of(kind)
    except TypeError as error:
        raise fault(kind, str(error), "declare every field so") from None
    for name in {name for form in (*kind.forms, *kind.spare_forms, kind.shown, kind.besides) for name in form}:
        if name not in names:
            raise fault(
                kind, f"`forms`, `spare_forms` or `shown` has {name!r}, which is no parameter", "correct the name"
            )


def effect_ids() -> list[str]:
    """The ids of all effects, in the order in which they act."""
    return list(_registry())


def effect_class(effect_id: str) -> type[Effect]:
    """The effect of an id; KeyError where there is none."""
    return _registry()[effect_id]
