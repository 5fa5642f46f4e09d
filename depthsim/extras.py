"""Packages that are extras: imported on demand, and named in one line where they are not installed.

`./run` installs an extra when a command first needs it: it says in the environment where it is and which extras it has
installed whole, and :func:`install_by_run` calls it again for one more.
"""

import importlib
import os
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.metadata import PackageNotFoundError, requires
from types import ModuleType

from depthsim.errors import InputError
from depthsim.resources import resource

RUN = "DEPTHSIM_RUN"
"""The path of `./run`, where that has started us and not everything is installed."""
EXTRAS = "DEPTHSIM_EXTRAS"
"""The extras that `./run` has installed whole, with spaces between."""


class MissingExtra(InputError):
    """A package is not installed that an extra of depthsim brings."""

    def __init__(self, package: str, problem: str, extra: str) -> None:
        super().__init__(package, "", problem, _how_to_install(extra))
        self.extra = extra


def load_extra(module: str, extra: str) -> ModuleType:
    """The module, or a :class:`MissingExtra`."""
    need_extra(extra)
    try:
        return importlib.import_module(module)
    except ImportError as error:
        package = module.partition(".")[0]
        raise MissingExtra(package, f"{package} cannot be imported ({error})", extra) from None


def need_extra(extra: str) -> None:
    """Raise :class:`MissingExtra` where `./run` has yet to install the extra; do so before anything is made."""
    if RUN in os.environ and not _is_whole(extra):  # what is half installed can perhaps be imported
        raise MissingExtra(extra, "is not installed", extra)


def install_by_run(missing: MissingExtra, arguments: Sequence[str]) -> None:
    """Become `./run`, which installs the extra and runs the command again; return where it cannot help."""
    if RUN in os.environ and not _is_whole(missing.extra):
        sys.stdout.flush()
        with suppress(OSError):  # it has been moved, say
            os.execv(os.environ[RUN], [os.environ[RUN], "--extra", missing.extra, *arguments])


def _is_whole(extra: str) -> bool:
    """Whether `./run` has installed it, by itself or within a larger one."""
    whole = os.environ.get(EXTRAS, "").split()
    return extra in whole or set(_packages(extra)) <= {package for name in whole for package in _packages(name)}


def _packages(extra: str) -> list[str]:
    """What an extra asks for, such as ``mcap>=1.2``, those of the extras within it too."""
    lines = [line.replace('"', "'").partition(";") for line in requires("depthsim") or []]
    return [package.strip() for package, _, marker in lines if marker.strip() == f"extra == '{extra}'"]


def _how_to_install(extra: str) -> str:
    """A command that is true here: depthsim is in no package index, so an installed one has to name the packages."""
    checkout = resource("pyproject.toml")
    if checkout.is_file():
        return f"install it by `pip install '.[{extra}]'` in {checkout.parent}"
    try:
        packages = " ".join(f"'{package}'" for package in _packages(extra))
    except PackageNotFoundError:
        packages = ""
    return f"install it by `pip install {packages}`" if packages else f"install depthsim with its extra {extra}"
