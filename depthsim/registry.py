"""Where effects are found: in a package of depthsim, and in files of one's own that ``DEPTHSIM_EFFECTS`` names.

A variable, and not a key of a profile: an effect must be there for every command and for the worker processes of a
sweep, whatever profile they use; and no file of data that somebody else wrote may have code run.
"""

import importlib
import importlib.util
import os
import pkgutil
import sys
import traceback
import zlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TypeVar

from depthsim.errors import InputError

T = TypeVar("T")
VARIABLE = "DEPTHSIM_EFFECTS"
"""Python files with effects, separated as the paths in ``PATH`` are."""


def load_package(name: str) -> None:
    """Import every module of a package, so that its classes are known."""
    for module in pkgutil.iter_modules(importlib.import_module(name).__path__):
        importlib.import_module(f"{name}.{module.name}")


@cache
def load_own() -> None:
    """Import the files that ``DEPTHSIM_EFFECTS`` names. Raises :class:`InputError` for one that cannot be."""
    for name in os.environ.get(VARIABLE, "").split(os.pathsep):
        if name:
            _load_file(Path(name))


def _load_file(path: Path) -> None:
    if not path.is_file():
        raise InputError(VARIABLE, str(path), "is no file", f"name Python files, with {os.pathsep!r} between them")
    full = path.resolve()
    name = f"depthsim_own_{zlib.crc32(str(full).encode()):08x}_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, full)
    if spec is None or spec.loader is None:
        raise InputError(VARIABLE, str(path), "is no Python file", "name files that end in .py")
    sys.modules[name] = module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        problem = f"cannot be imported ({type(error).__name__}: {getattr(error, 'msg', None) or error})"
        raise InputError(path, _line(error, str(full)), problem, "correct it there") from error
    if not _ids(module):
        raise InputError(path, "", "holds no effect", "write a class with an `id` there, or leave the file out")


def _line(error: Exception, file: str) -> str:
    """Where in ``file`` an error arose."""
    if isinstance(error, SyntaxError) and error.filename == file:
        return f"line {error.lineno}"
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file]
    return f"line {lines[-1]}" if lines else ""


def _ids(module: ModuleType) -> list[str]:
    """The ids of the classes that a module defines."""
    classes = [value for value in vars(module).values() if isinstance(value, type)]
    return [vars(kind)["id"] for kind in classes if kind.__module__ == module.__name__ and "id" in vars(kind)]


def with_ids(base: type[T], needed: Sequence[str]) -> dict[str, type[T]]:
    """The classes below ``base`` that have an id of their own, by it.

    Raises :class:`InputError` where one of them lacks an attribute of ``needed``, and where two have one id.
    """
    found: dict[str, type[T]] = {}
    for kind in _below(base):
        name = vars(kind)["id"]
        if lacking := [attribute for attribute in needed if not hasattr(kind, attribute)]:
            raise fault(kind, f"has no `{lacking[0]}`", f"write {', '.join(lacking)} in the class")
        if found.setdefault(name, kind) is not kind:
            raise fault(kind, f"the id {name!r} is that of {_place(found[name])} too", "choose another id")
    return found


def check_words(kind: type, name: str, known: Sequence[str]) -> None:
    """Raise :class:`InputError` where ``kind``'s attribute ``name`` is no tuple of ``known`` words."""
    given = getattr(kind, name)
    if not isinstance(given, tuple):
        raise fault(kind, f"`{name}` is no tuple", f"write {name} = ({str(given)!r},)")
    for word in given:
        if word not in known:
            raise fault(kind, f"there is no {word!r} that `{name}` could have", f"the words are {', '.join(known)}")


def fault(kind: type, problem: str, fix: str) -> InputError:
    """The error that a class cannot be an effect."""
    return InputError(_place(kind), kind.__name__, problem, fix)


def _place(kind: type) -> str:
    return str(getattr(sys.modules.get(kind.__module__), "__file__", None) or kind.__module__)


def _below(base: type[T]) -> list[type[T]]:
    below = [sub for child in base.__subclasses__() for sub in (child, *_below(child))]
    return [sub for sub in dict.fromkeys(below) if "id" in vars(sub)]
