"""A parameter of an effect: what the simulator allows, what people read of it, and how a fit is to vary it."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field
from pydantic.fields import FieldInfo

from depthsim.materials import Materials

Scale = Literal["linear", "log", "range"]
"""How a fit varies a parameter: by equal steps, by equal factors, or, where it is a range in the scene, by steps of
those at which the scene has something to see."""


@dataclass(frozen=True)
class Setting:
    """What of a recording decides where fits begin.

    tags: materials that are seen. ranges: the depth [m] at the shares ``SHARES`` of the pixels. span: time from first
    to last frame [s]. materials: what the simulator has of each tag. steps: of the disparities, where they have any:
    their width [px] and where they begin, see :func:`~depthsim.gap.depth.data.quantization.find_steps`.
    learned: by effect, its parameters with the :func:`learned` tables as the recording has them, in one form or more.
    size: width and height of the pictures that the left imager gave [px].
    doubled: zoom and roll [deg] of a picture whose rows are doubled by a resampling, see
    :func:`~depthsim.gap.depth.data.doubling.find_doubling`. undoubled: whether the pictures are whole, and have no such
    rows. zoom: focal length of the camera's colour pictures over that of its depth, if it says where they are.
    turn, shift: [deg], [m] by which registration finds the camera turned and shifted against its poses, about and along
    its x, y and z; late: [s] by which the stamps are found early. None where it does not know.
    border: columns on the left and right, rows at the top and bottom that are empty in every frame, see
    :func:`~depthsim.gap.depth.data.border.find_border`; None where there are none. tiled: the side [px] of tiles that
    have one value each, see :func:`~depthsim.gap.depth.data.tiles.find_tiles`. aligned: whether the pictures say that
    they are aligned to colour.
    """

    SHARES = (0, 0.02, 0.06, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95, 0.985, 0.996, 1)

    tags: tuple[str, ...]
    ranges: NDArray[np.float64]
    span: float
    materials: Materials
    steps: tuple[float, float] | None = None
    learned: Mapping[str, Sequence[Mapping[str, Any]]] = dataclasses.field(default_factory=dict)
    size: tuple[int, int] | None = None
    doubled: tuple[float, float] | None = None
    undoubled: bool = False
    zoom: float | None = None
    turn: tuple[float, float, float] | None = None
    shift: tuple[float, float, float] | None = None
    late: float | None = None
    border: tuple[int, int, int, int] | None = None
    tiled: int | None = None
    aligned: bool = False

    def depths(self, *shares: float) -> list[float]:
        """The depths [m] than which these shares of the pixels are nearer."""
        return [float(np.interp(share, self.SHARES, self.ranges)) for share in shares]


Starts = Sequence[float] | Callable[[Setting], Sequence[float]]
"""Where fits begin: values, or what gives them from the recording at hand."""


@dataclass(frozen=True)
class Parameter:
    """What is known of a parameter.

    default: a typical camera's value. low, high: bounds. neutral: where the effect does nothing, None without such a
    value. about, source: what it is, and where the default is from. whole: only whole numbers are allowed.

    starts, scale: where a fit begins and how it varies the parameter, None for the usual (see :meth:`begin` and
    :attr:`scaled`). frozen: recordings hardly show it, so fits leave it as it is.

    step: a change that matters, None for the usual.
    by_material: there is one value for each tag; what a profile leaves out is materials.yaml's value of this name,
    where it has one; its step is always given. likely: the highest that a fit tries, where that is
    below the bound.
    drawn_as: a value of a sweep (``light.azimuth``) that this parameter shares with other parts of the sensor.
    """

    name: str
    default: Any
    low: float
    high: float
    unit: str
    about: str
    source: str
    neutral: float | None = None
    starts: Starts | None = None
    scale: Scale | None = None
    step: float | None = None
    frozen: bool = False
    whole: bool = False
    by_material: bool = False
    likely: float | None = None
    drawn_as: str | None = None

    @property
    def scaled(self) -> Scale:
        """How a fit varies it: a strength, which is 0 at least, by factors; what may have either sign by steps."""
        if self.scale is not None or self.whole or self.by_material:
            return self.scale or "linear"
        return "log" if (self.low >= 0 and self.neutral == 0) or (self.low > 0 and self.neutral is None) else "linear"

    def begin(self, setting: Setting) -> list[float]:
        """Where fits begin, within the bounds.

        Where nothing else is said: a third, one and a half and eight times the default of a strength; the neutral
        value and the default's distance to either side of it; or the default alone.
        """
        if callable(self.starts):
            chosen = self.starts(setting)
        elif self.starts is not None:
            chosen = self.starts
        elif self.scaled == "log":
            chosen = [self.default * k for k in (0.3, 1.5, 8.0)]
        elif self.neutral is None:
            chosen = [self.default]
        else:
            sides = [self.neutral + (self.default - self.neutral) * k for k in (0.0, 1.0, -1.0)]
            chosen = [value for value in sides if self.low <= value <= self.high]
        return [float(np.clip(value, self.low, self.high)) for value in chosen]


def parameter(
    default: Any,
    *,
    low: float,
    high: float,
    unit: str,
    about: str,
    source: str,
    neutral: float | None = None,
    starts: Starts | None = None,
    scale: Scale | None = None,
    step: float | None = None,
    frozen: bool = False,
    drawn_as: str | None = None,
) -> Any:
    """Declare a parameter of an effect, a number; see :class:`Parameter`. Fits vary it, unless it is ``frozen``."""
    declared = {"neutral": neutral, "starts": starts, "scale": scale, "frozen": frozen, "drawn_as": drawn_as}
    extra: dict[str, Any] = {"unit": unit, "source": source, "step": step, **declared}
    return Field(default, ge=low, le=high, allow_inf_nan=False, description=about, json_schema_extra=extra)


def by_material(
    *,
    unit: str,
    about: str,
    source: str,
    step: float,
    starts: Starts | None = None,
    likely: float | None = None,
) -> Any:
    """Declare a parameter with a value for each material: ``dict[str, Annotated[FiniteFloat, Field(ge=…, le=…)]]``.

    starts: for materials of which materials.yaml has no value of this name.
    """
    extra: dict[str, Any] = {"unit": unit, "source": source, "step": step, "starts": starts, "likely": likely}
    return Field(default_factory=dict, description=about, json_schema_extra=extra)


def learned(*, about: str) -> Any:
    """Declare a table of an effect that no slider sets and no fit varies: it is learned from a recording, or None.

    It is written to a profile and read from one as the parameters are; ``parameters_of`` leaves it out.
    """
    return Field(None, description=about, json_schema_extra={"learned": True})


@cache
def learned_of(kind: type[BaseModel]) -> Mapping[str, str]:
    """What an effect's :func:`learned` tables are, by name."""
    return {name: field.description or "" for name, field in kind.model_fields.items() if _is_learned(field)}


def _is_learned(field: FieldInfo) -> bool:
    return isinstance(field.json_schema_extra, dict) and "learned" in field.json_schema_extra


@cache
def parameters_of(kind: type[BaseModel]) -> Mapping[str, Parameter]:
    """The parameters of an effect by name, in their order."""
    found = {}
    for name, field in kind.model_fields.items():
        if _is_learned(field):
            continue
        if not isinstance(field.json_schema_extra, dict) or not {"unit", "source"} <= field.json_schema_extra.keys():
            raise TypeError(f"{kind.__name__}.{name} is not declared with parameter(...) or by_material(...)")
        found[name] = _read(name, field, dict(field.json_schema_extra))
    return found


def _read(name: str, field: FieldInfo, extra: dict[str, Any]) -> Parameter:
    is_table = field.default_factory is not None
    limits = _limits_of_values(field.annotation) if is_table else field.metadata
    return Parameter(
        name=name,
        default=field.get_default(call_default_factory=True),
        low=next(float(limit.ge) for limit in limits if getattr(limit, "ge", None) is not None),
        high=next(float(limit.le) for limit in limits if getattr(limit, "le", None) is not None),
        about=field.description or "",
        whole=field.annotation is int,
        by_material=is_table,
        **extra,
    )


def _limits_of_values(annotation: Any) -> list[Any]:
    """What holds for the values of ``dict[str, Annotated[float, Field(...)]]``."""
    metadata = annotation.__args__[1].__metadata__
    return [item for part in metadata for item in getattr(part, "metadata", [part])]
