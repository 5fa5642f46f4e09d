"""Packages that are extras: imported on demand, and told in one line where they are missing."""

import importlib
from types import ModuleType

from depthsim.errors import InputError


def load_extra(module: str, extra: str) -> ModuleType:
    """The module, or an :class:`InputError` that says which extra of depthsim brings it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        problem = f"{package} cannot be imported ({error})"
        raise InputError(package, "", problem, f"install it by `pip install 'depthsim[{extra}]'`") from None
