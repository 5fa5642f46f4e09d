"""Mutations of YAML and JSON documents that know where keys, lists and values are."""

import datetime
import json
import math
from copy import deepcopy
from random import Random
from typing import Any

import yaml

from qa.fuzzing.plain import WORDS, mutate_text

_Dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_Loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)

_VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 3, 10**6, 10**12, 10**30, -(10**30), 1 << 63, 0.0, -0.0, 1e-9, 5e-324, 1e-300,
    1e300,
    1e308, -1e308, math.nan, math.inf, -math.inf, "", "nan", "1", "auto", [], {}, [[]], [0], [0, 0, 0], [1, 2],
    [math.nan] * 3, [1e308] * 3, ["a", 1], {"a": 1}, {1: 2}, {"": ""}, {"*": "lava"}, {"file": "../x.obj"},
    datetime.date(2020, 1, 1), b"\x00\xff", *WORDS,
)  # fmt: skip

_LAUGHS = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 12)
)
_MERGES = "m0: &m0 {x: 1}\n" + "".join(
    f"m{k}: &m{k} {{<<: [{', '.join([f'*m{k - 1}'] * 10)}]}}\n" for k in range(1, 12)
)
_TAGS = (
    "!!python/object/apply:os.system ['true']", "!!python/name:os.system ''", "!!python/tuple [1, 2]", "!!binary '=='",
    "!!binary aGVsbG8=", "!!timestamp '2001-99-99'", "!!timestamp x", "!!bool x", "!!int x", "!!int ''", "!!float ''",
    "!!float 1:2:3", "!!int 1:2:3", "!!null x", "!!set {a, b}", "!!omap [a: 1]", "!!pairs [a: 1]", "!!map [1]",
    "!!seq {a: 1}", "!!str [1]", "!nobody x", "*nobody", "&a [*a]", "&a {b: *a}", "!!merge x", "!!value =",
    "2001-12-14t21:59:43.10-05:00", "9" * 5000, "0b" + "1" * 5000, "1" + ":0" * 500, "? [a]\n: b", "{[a]: b}",
    "{{a: b}: c}",
    "|\n  text", ">-\n  text", "'", '"', "[", "{", "- - - -", "\t- x", "%YAML 9.9\n---", "...", "--- a\n--- b", "@",
    "`",
    "[" * 900, "[" * 20000, "{a: " * 900, "- " * 3000, "? " * 2000, '"\\ud800"', '"\\0"', "\x07", "\x85",
)  # fmt: skip


def mutate_document(value: Any, rng: Random) -> Any:
    """The document with one to a few of its parts changed."""
    value = deepcopy(value)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        places = list(_places(value))
        if not places:
            return rng.choice(_VALUES)
        holder, key = rng.choice(places)
        value = _change(value, holder, key, rng)
    return value


def mutate_yaml(data: bytes, rng: Random) -> bytes:
    """YAML text, mostly of a changed document, else with what only YAML has, or of changed text."""
    lot = rng.random()
    if lot < 0.55:
        document = mutate_document(_loaded(data), rng)
        try:
            text: str = yaml.dump(document, Dumper=_Dumper, sort_keys=False, allow_unicode=True)
        except RecursionError:  # deeper than PyYAML writes
            return b"[" * 2000 + b"1"
        return text.encode("utf-8", "surrogatepass")
    if lot < 0.75:
        return _with_tags(data, rng)
    return mutate_text(data, rng)


def mutate_json(data: bytes, rng: Random) -> bytes:
    """JSON text, of a changed document or of changed text."""
    if rng.random() < 0.75:
        return as_json(mutate_document(json.loads(data), rng))
    lot = rng.random()
    if lot < 0.05:
        return b"[" * rng.choice((100, 100_000)) + b"1"
    if lot < 0.1:
        return b'{"a":' * 50_000
    return mutate_text(data, rng)


def as_json(value: Any) -> bytes:
    """JSON text, with NaN and the rest as Python writes them."""
    return json.dumps(_plain(value)).encode()


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value if isinstance(value, str | int | float | bool | None) else str(value)


_KNOWN: dict[bytes, Any] = {}


def _loaded(data: bytes) -> Any:
    if data not in _KNOWN:
        _KNOWN[data] = yaml.load(data, Loader=_Loader)  # a SafeLoader
    return _KNOWN[data]


def _places(value: Any) -> Any:
    """Every (holder, key) in a document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in items:
        yield value, key
        yield from _places(item)


def _change(whole: Any, holder: Any, key: Any, rng: Random) -> Any:
    old = holder[key]
    how = rng.randrange(12)
    if how == 0:
        del holder[key]
    elif how == 1 and isinstance(holder, list):
        holder[key:key] = [old] * rng.choice((1, 2, 30, 400))
    elif how == 1:
        holder[rng.choice((*WORDS, "name", "file", "shape", 7))] = old
    elif how == 2:
        holder[key] = [old]
    elif how == 3:
        holder[key] = {str(key): old}
    elif how == 4:
        other, there = rng.choice(list(_places(whole)))
        holder[key] = deepcopy(other[there])
    elif how == 5 and isinstance(holder, dict):
        holder[rng.choice((*WORDS, 1, 2.5, None, True))] = holder.pop(key)
    elif how in (6, 7, 8) and isinstance(old, int | float) and not isinstance(old, bool):
        holder[key] = _number(old, rng)
    elif how == 9:
        deep: Any = old
        for _ in range(rng.choice((3, 30, 120))):
            deep = [deep]
        holder[key] = deep
    else:
        holder[key] = deepcopy(rng.choice(_VALUES))
    return whole


def _number(old: float, rng: Random) -> float:
    if isinstance(old, int) and rng.random() < 0.5:
        return rng.choice((-old, old + 1, old - 1, old * 10, old * 1000, old * 10**9, old // 2))
    return float(old) * rng.choice((-1, 0.5, 2, 1e-3, 1e3, 1e-12, 1e12, 1e-200, 1e200, 1e-308, 1e308))


def _with_tags(data: bytes, rng: Random) -> bytes:
    """A value becomes something that only YAML can say; anchors that double and double again."""
    lines = data.decode().split("\n")
    at = rng.randrange(len(lines))
    key, colon, _ = lines[at].partition(":")
    lot = rng.random()
    if lot < 0.1:
        return (_LAUGHS + "\n".join([*lines[:at], f"{key}: *a{rng.randrange(12)}", *lines[at + 1 :]])).encode()
    if lot < 0.2:
        return (_MERGES + "\n".join([*lines[:at], f"{key}: *m{rng.randrange(12)}", *lines[at + 1 :]])).encode()
    if lot < 0.3:
        return "\n".join(
            [*lines, f"<<: {rng.choice(('[]', '{a: 1}', '[{a: 1}, 2]', 'x', '*a', '&b {<<: *b}'))}"]
        ).encode()
    tag = rng.choice(_TAGS)
    lines[at] = f"{key}: {tag}" if colon else tag
    return "\n".join(lines).encode("utf-8", "surrogatepass")
