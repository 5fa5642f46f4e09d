"""The builders by name, and their parameters checked against their signatures."""

import inspect
import math
from collections.abc import Callable

from depthsim.procedural.corridor import corridor
from depthsim.procedural.forest import forest
from depthsim.procedural.office import office
from depthsim.procedural.part import Part
from depthsim.procedural.race import race
from depthsim.procedural.tunnel import tunnel
from depthsim.procedural.wall import wall

BUILDERS: dict[str, Callable[..., Part]] = {
    builder.__name__: builder for builder in (corridor, forest, office, race, tunnel, wall)
}
"""By name, the functions that make a scene from typed keyword parameters that all have a default."""

_KINDS = {int: "a whole number", float: "a finite number", str: "a text"}


def build(name: str, **parameters: object) -> Part:
    """The mesh of the scene ``name``; the same parameters give the same bytes.

    Raises ValueError, in one line as "problem; mend", for a name or a parameter that is not known, and for a value of
    the wrong kind or out of its range.
    """
    builder = BUILDERS.get(name)
    if builder is None:
        raise ValueError(f"no builder is called {name!r}; the builders are {', '.join(sorted(BUILDERS))}")
    known = inspect.signature(builder, eval_str=True).parameters
    for key, value in parameters.items():
        if key not in known:
            raise ValueError(f"{name} has no parameter {key!r}; its parameters are {', '.join(known)}")
        kind = known[key].annotation
        if not _fits(value, kind):
            raise ValueError(f"{name}: {key} is {value!r}; give {_KINDS[kind]} such as {known[key].default!r}")
    return builder(**parameters)


def _fits(value: object, kind: type) -> bool:
    if isinstance(value, bool):
        return False
    return isinstance(value, int | float) and math.isfinite(value) if kind is float else isinstance(value, kind)
