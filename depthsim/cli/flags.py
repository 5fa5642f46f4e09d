"""From the library's names of arguments to the command line's flags, in this one place.

The library names an argument in back quotes, as in "give another `out`". Here it becomes what the command that runs has
for it; a name that the command does not have stays as it is.
"""

import re
from collections.abc import Mapping
from contextvars import ContextVar
from typing import Any

from typer.core import TyperCommand

from depthsim.errors import InputError

_ARGUMENT = re.compile(r"`([a-z_]+)`")
_OTHER_NAMES = {"address": "ray", "choice": "vehicle", "form": "to", "most_incidence": "max_incidence", "path": "out",
                "systems": "system", "tags": "tag", "target": "out"}  # fmt: skip
"""Arguments of the library that are a parameter of another name in the function of a command."""
_FLAGS: ContextVar[Mapping[str, str]] = ContextVar("_FLAGS")


def in_flags(text: str) -> str:
    """The text as the command that runs words it."""
    flags = _FLAGS.get({})
    return _ARGUMENT.sub(lambda found: flags.get(_OTHER_NAMES.get(found[1], found[1]), found[0]), text)


class Command(TyperCommand):
    """A command whose errors name its flags."""

    def invoke(self, ctx: Any) -> Any:
        """Run it."""
        options = [parameter for parameter in self.params if parameter.opts[0].startswith("--")]
        _FLAGS.set({str(parameter.name): parameter.opts[0] for parameter in options})
        try:
            return super().invoke(ctx)
        except InputError as error:
            error.reword(in_flags)
            raise
