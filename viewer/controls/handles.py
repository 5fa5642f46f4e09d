"""Reading and setting the controls of a page. A browser may send any text, whatever its menu offers."""

from typing import Any

from depthsim.errors import InputError


def picked(menu: Any) -> str:
    """The choice of a dropdown. Raises :class:`InputError` for one that it does not offer."""
    value = str(menu.value)
    if value not in menu.options:
        raise InputError(
            menu.label, repr(value[:60]), "is not among the choices", f"pick one of {', '.join(menu.options)}"
        )
    return value


def put(control: Any, value: object) -> None:
    """Set what a control shows. Its callbacks are called before this returns."""
    control.value = value
