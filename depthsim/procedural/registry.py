"""The builders by name, and their parameters checked against their signatures."""

import inspect
import sys
from collections.abc import Callable

from depthsim.procedural.corridor import corridor
from depthsim.procedural.forest import forest
from depthsim.procedural.movers import door_leaf, drone, person
from depthsim.procedural.office import office
from depthsim.procedural.part import Part
from depthsim.procedural.race import race
from depthsim.procedural.tunnel import tunnel
from depthsim.procedural.wall import wall

BUILDERS: dict[str, Callable[..., Part]] = {
    builder.__name__: builder for builder in (corridor, forest, office, race, tunnel, wall)
}
"""By name, the functions that make a scene from typed keyword parameters that all have a default."""

_TOO_LONG = 1 << 63
_KINDS = {int: "a whole number", float: "a finite number", str: "a text"}

OBJECTS: dict[str, Callable[..., Part]] = {builder.__name__: builder for builder in (door_leaf, drone, person)}
"""Likewise, the functions that make a thing for a scene."""


def build(name: str, **parameters: object) -> Part:
    """The mesh of the scene ``name``; the same parameters give the same bytes.

    Raises ValueError, in one line as "problem; fix", for a name or a parameter that is not known, and for a value of
    the wrong kind or out of its range.
    """
    builders = BUILDERS | OBJECTS
    builder = builders.get(name)
    if builder is None:
        raise ValueError(f"no builder is called {name!r}; the builders are {', '.join(sorted(builders))}")
    known = inspect.signature(builder, eval_str=True).parameters
    for key, value in parameters.items():
        if key not in known:
            raise ValueError(f"{name} has no parameter {key!r}; its parameters are {', '.join(known)}")
        kind = known[key].annotation
        if not _fits(value, kind):
            raise ValueError(f"{name}: {key} is {_shown(value)}; give {_KINDS[kind]} such as {known[key].default!r}")
    return builder(**parameters)


def _fits(value: object, kind: type) -> bool:
    if isinstance(value, bool):
        return False
    if kind is float:
        return isinstance(value, int | float) and abs(value) <= sys.float_info.max
    return isinstance(value, kind) and not (isinstance(value, int) and abs(value) >= _TOO_LONG)


def _shown(value: object) -> str:
    """As it is written, but for a number so long that Python does not write it."""
    if isinstance(value, int) and abs(value) >= _TOO_LONG:
        return f"a number of {value.bit_length()} bits"
    return repr(value)
