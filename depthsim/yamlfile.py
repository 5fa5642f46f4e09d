"""Reading YAML into pydantic models, every fault in one line that names the file, the place and the fix."""

import json
from pathlib import Path
from typing import Any, TypeVar

import yaml
from pydantic import BaseModel, ValidationError

from depthsim.errors import InputError

Model = TypeVar("Model", bound=BaseModel)


MOST_TEXT = 500_000
"""Characters in a document; PyYAML takes half a second for these, and some seconds where it has no libyaml."""
MOST_NODES = 1_000_000
"""Values in a document, those of an alias counted wherever it stands."""
MOST_LEVELS = 100
"""Lists and mappings within each other. libyaml's composer calls itself for each, until it overruns the stack."""

_Safe: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml where PyYAML has it: 7 times as fast."""


class _Loader(_Safe):
    """The safe loader, without YAML's silent acceptance of a key given twice."""

    def __init__(self, text: str) -> None:
        _check_depth(text)
        super().__init__(text)

    def get_single_node(self) -> yaml.Node | None:
        """The document; an error where its aliases hold themselves, or unfold to more than anyone wrote.

        A few lines of aliases of aliases stand for a billion values, which fill the memory as soon as they are walked.
        """
        node: yaml.Node | None = super().get_single_node()
        if node is not None:
            _count(node, {})
        return node

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> dict[Any, Any]:
        seen: set[str] = set()
        for key, _ in node.value if isinstance(node, yaml.MappingNode) else ():  # `!!map [1]` is none
            if isinstance(key, yaml.ScalarNode):
                if key.value in seen and key.value != "<<":
                    raise yaml.constructor.ConstructorError(None, None, f"key {key.value!r} twice", key.start_mark)
                seen.add(key.value)
        mapping: dict[Any, Any] = super().construct_mapping(node, deep)
        return mapping


def _check_depth(text: str) -> None:
    """An error where lists and mappings lie deeper than any reader of ours asks for."""
    depth = 0
    for event in yaml.parse(text, Loader=_Safe):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MOST_LEVELS:
                problem = f"nested deeper than {MOST_LEVELS}"
                raise yaml.constructor.ConstructorError(None, None, problem, event.start_mark)  # type: ignore[arg-type]
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1


def _count(node: yaml.Node, known: dict[int, int | None]) -> int:
    """How many values a node stands for."""
    if isinstance(node, yaml.ScalarNode):
        return 1
    if id(node) not in known:
        known[id(node)] = None
        parts = node.value if isinstance(node, yaml.SequenceNode) else [part for pair in node.value for part in pair]
        known[id(node)] = 1 + sum(_count(part, known) for part in parts)
    count = known[id(node)]
    if count is None or count > MOST_NODES:
        problem = "an alias that holds itself" if count is None else f"aliases for over {MOST_NODES:,} values"
        raise yaml.constructor.ConstructorError(None, None, problem, node.start_mark)
    return count


def read_text(path: Path, what: str) -> str:
    """The text of a file, or an :class:`InputError` that says what file was looked for."""
    try:
        return path.read_text(encoding="utf-8-sig")  # Windows editors put a mark first
    except FileNotFoundError:
        raise InputError(path, "", "no such file", f"give the path of {what}") from None
    except IsADirectoryError:
        raise InputError(path, "", "is a folder", f"give the path of {what}") from None
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "is not UTF-8 text", f"give {what}") from None
    except ValueError:  # a NUL in the name
        raise InputError(repr(str(path)), "", "is no path", f"give the path of {what}") from None
    except OSError as error:
        raise InputError(path, "", (error.strerror or str(error)).lower(), f"give {what} that can be read") from None


def parse_yaml(text: str, path: Path) -> Any:
    """The plain value that YAML text holds."""
    if len(text) > MOST_TEXT:
        problem = f"holds {len(text):,} characters, more than the {MOST_TEXT:,} that are read as YAML"
        raise InputError(path, "", problem, "leave some out; many poses are better kept in a TUM file")
    try:
        loader = _Loader(text)
        try:
            return loader.get_single_data()
        finally:
            loader.dispose()
    except (yaml.YAMLError, RecursionError, ValueError, LookupError, AttributeError, ArithmeticError) as error:
        # PyYAML lets the last four out where a tag does not fit its value, such as `!!bool x`.
        mark = getattr(error, "problem_mark", None)
        place = f"line {min(mark.line, text.count(chr(10))) + 1}" if mark else ""  # libyaml counts the end as one
        problem = getattr(error, "problem", None) or str(error)
        raise InputError(path, place, f"is not YAML ({problem})", "correct the syntax there") from None


def parse_json(text: str | bytes) -> Any:
    """The plain value that JSON text holds; ValueError, and no other, for what is not JSON or nests without end."""
    try:
        return json.loads(text)
    except RecursionError as error:
        raise ValueError(str(error)) from None


def read_mapping(path: Path, what: str) -> dict[str, Any]:
    """The mapping in a YAML file; anything else at its top level is an error."""
    value = parse_yaml(read_text(path, what), path)
    if not isinstance(value, dict):
        found = "is empty" if value is None else f"holds a {type(value).__name__} at its top, not a mapping"
        raise InputError(path, "", found, f"write {what} as `key: value` lines")
    return {str(key): item for key, item in value.items()}


def validate(model: type[Model], value: Any, path: Path, place: str = "") -> Model:
    """``value`` as ``model``; the first thing that does not fit is reported, with its place in the file."""
    try:
        return model.model_validate(value)
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        where = ".".join(str(part) for part in (place, *first["loc"]) if part != "")
        problem = first["msg"].removeprefix("Value error, ")
        problem = problem[0].lower() + problem[1:]
        about_keys = first["type"] in ("missing", "extra_forbidden") and len(first["loc"]) == 1
        known = ", ".join(model.model_fields) if about_keys else ""
        given = first.get("input")
        shown = "" if first["type"] == "missing" or isinstance(given, dict | list) else f" (it is {given!r})"
        add_or_correct = "add it" if first["type"] == "missing" else "correct that value"
        fix = f"the keys are {known}" if known else add_or_correct
        raise InputError(path, where, problem + shown[:80], fix) from None


def read_model(model: type[Model], path: Path, what: str) -> Model:
    """A YAML file as ``model``."""
    return validate(model, read_mapping(path, what), path)


def beside(file: Path, name: str, place: str) -> Path:
    """The path that ``name``, written at ``place`` in ``file``, means; it may not leave the folder of ``file``.

    Links are followed: one that leads out of the folder leaves it. Whether the path is there may be asked of it.
    """
    folder = file.parent.resolve()
    plain = "\0" not in name and not Path(name).is_absolute() and ".." not in Path(name).parts
    try:
        inside = plain and (folder / name).resolve().is_relative_to(folder)
        (folder / name if inside else folder).exists()
    except (OSError, RuntimeError, ValueError) as error:  # too long a name, a loop of links, a lone surrogate
        why = getattr(error, "strerror", None) or "a loop of links"
        raise InputError(file, place, f"{name[:80]!r} cannot be a path ({why.lower()})", "correct the name") from None
    if inside:
        return file.parent / name
    raise InputError(file, place, f"{name[:200]!r} leaves the folder of this file", "give a path inside the folder")
