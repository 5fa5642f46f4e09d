"""What an effect is, and the registry that simulator, profiles, viewer and diagnosis read.

An effect is one thing, used twice: what the simulator applies to a clean frame, and the hypothesis that the diagnosis
fits to a real one. To add one, write a class in ``depthsim/sensor/effects/``: the registry finds it by itself.
"""

import importlib
import pkgutil
from enum import IntEnum
from functools import cache
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Field

from depthsim.sensor.frame import Frame
from depthsim.sensor.view import View


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
    MISSING = 5
    """depths that are not returned"""
    PROCESSING = 6
    """what the camera does to the finished picture"""


class Effect(BaseModel):
    """One physical effect of a depth sensor, with its parameters as fields.

    A subclass sets ``id``, ``stage`` and ``source``, declares its parameters with :func:`parameter`, and acts in
    :meth:`apply`, or in :meth:`bend` where the rays themselves are others. An effect whose parameters are all neutral
    is left out of the sensor and so changes not one bit.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    id: ClassVar[str]
    stage: ClassVar[Stage]
    source: ClassVar[str]
    rank: ClassVar[int] = 0
    """the order within a stage; effects of one rank act in the order of their ids"""
    needs_right: ClassVar[bool] = False
    """whether the effect asks what the right imager sees"""

    def bend(self, view: View) -> None:
        """Change what the frame is cast with; for the stages POSE and OPTICS."""
        raise NotImplementedError

    def apply(self, frame: Frame) -> None:
        """Change ``frame`` in place; for every later stage."""
        raise NotImplementedError

    @property
    def material_tags(self) -> tuple[str, ...]:
        """The tags that the parameters name; the sensor checks that there are such materials."""
        return ()

    @property
    def is_neutral(self) -> bool:
        """Whether the effect does nothing because any one of its parameters has its neutral value."""
        return any(
            neutral_value(type(self), name) is not None and getattr(self, name) == neutral_value(type(self), name)
            for name in type(self).model_fields
        )


def parameter(
    default: Any, *, low: float, high: float, unit: str, about: str, source: str, neutral: float | None = None
) -> Any:
    """A parameter of an effect: its default is a typical camera's value; at ``neutral`` the effect does nothing."""
    extra: dict[str, Any] = {"unit": unit, "source": source, "neutral": neutral}
    return Field(default, ge=low, le=high, allow_inf_nan=False, description=about, json_schema_extra=extra)


def neutral_value(effect: type[Effect], name: str) -> float | None:
    """The value of a parameter at which the effect does nothing, or None where it has no such value."""
    extra = effect.model_fields[name].json_schema_extra
    value = extra.get("neutral") if isinstance(extra, dict) else None
    return float(value) if isinstance(value, int | float) else None


def physical_order(effect: Effect | type[Effect]) -> tuple[int, int, str]:
    """Where an effect comes in the physical order: sort by this."""
    return int(effect.stage), effect.rank, effect.id


@cache
def _registry() -> dict[str, type[Effect]]:
    import depthsim.sensor.effects as package

    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")
    found: dict[str, type[Effect]] = {}
    for kind in _all_subclasses(Effect):
        if found.setdefault(kind.id, kind) is not kind:
            raise TypeError(f"two effects have the id {kind.id!r}: {found[kind.id].__module__} and {kind.__module__}")
    return dict(sorted(found.items(), key=lambda item: physical_order(item[1])))


def _all_subclasses(kind: type[Effect]) -> list[type[Effect]]:
    """The classes below ``kind`` that have an id of their own."""
    below = [sub for child in kind.__subclasses__() for sub in (child, *_all_subclasses(child))]
    return [sub for sub in below if "id" in vars(sub)]


def effect_ids() -> list[str]:
    """The ids of all effects, in the order in which they act."""
    return list(_registry())


def effect_class(effect_id: str) -> type[Effect]:
    """The effect of an id; KeyError where there is none."""
    return _registry()[effect_id]
