"""Mutations that need no knowledge of a format: of bytes, and of text."""

import re
import struct
from random import Random

MOST = 1 << 20
"""[bytes] What is kept of a mutated file."""

NUMBERS = (
    "0", "-0", "1", "-1", "2", "127", "128", "255", "256", "65535", "65536", "2147483647", "2147483648", "-2147483649",
    "4294967296", "9223372036854775807", "9223372036854775808", "1000000000000", "99999999999999999999999999",
    "1e-9", "1e-320", "5e-324", "1e9", "1e18", "1e300", "1e308", "-1e308", "1e309", "1e999", "nan", "-nan", "inf",
    "-inf", ".nan", ".inf", "0x10", "1_000", "1:30:00", "٣", "²", "½", "", "-", ".", "1.2.3", "1e", "0.1", "0.5",
    "3.14",
)  # fmt: skip
"""What takes the place of a number."""

WORDS = (
    "../../etc/passwd", "/etc/passwd", "..", ".", "/", "//", "~", "a/../../b", "\\..\\x", "C:\\x", "con", "a" * 300,
    "a/" * 40 + "b", "a/" * 2100 + "b", "\0", "a\0b", "\ud800".encode("utf-8", "surrogatepass").decode("latin-1"), "é",
    "😀", "\u202e", "\ufeff", "\x85", "\u2028", "%00", "%2e%2e%2fx", "file:///etc/passwd", "data:,", "data:;base64,!!!",
    "null", "true", "none", "*", "(none)", "#", "cement", "{}", "[]", "-", "'", '"', "`", "$HOME", "%s", "{0}", "\t",
)  # fmt: skip
"""What takes the place of a name."""

_TOKEN = re.compile(rb"[-+]?\d[\d.eE+-]*")
_WORD = re.compile(rb"[A-Za-z_][\w./-]*")
_WIDTHS = ("<b", "<h", "<i", "<q", ">h", ">i", ">q", "<f", "<d")
_EXTREME = (
    0,
    1,
    -1,
    2,
    7,
    127,
    -128,
    255,
    1 << 15,
    (1 << 16) - 1,
    (1 << 31) - 1,
    1 << 31,
    (1 << 32) - 1,
    1 << 40,
    1 << 62,
)


def extreme(rng: Random) -> bytes:
    """An extreme number as the bytes of some type."""
    code = rng.choice(_WIDTHS)
    if code[1] in "fd":
        value = rng.choice((float("nan"), float("inf"), -float("inf"), 0.0, -1.0, 1e30, 1e-38, 3.4e38))
        return struct.pack(code, value)
    size = struct.calcsize(code)
    value = rng.choice(_EXTREME) & ((1 << (8 * size)) - 1)
    return value.to_bytes(size, "little" if code[0] == "<" else "big")


def _flip(data: bytearray, rng: Random) -> bytearray:
    for _ in range(rng.choice((1, 1, 2, 8))):
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    return data


def _set(data: bytearray, rng: Random) -> bytearray:
    data[rng.randrange(len(data))] = rng.choice((0, 1, 9, 10, 32, 34, 35, 45, 58, 127, 128, 255, rng.randrange(256)))
    return data


def _extreme(data: bytearray, rng: Random) -> bytearray:
    number = extreme(rng)
    at = rng.randrange(len(data))
    data[at : at + len(number)] = number
    return data


def _cut(data: bytearray, rng: Random) -> bytearray:
    return data[: rng.randrange(len(data))]


def _behead(data: bytearray, rng: Random) -> bytearray:
    return data[rng.randrange(len(data)) :]


def _remove(data: bytearray, rng: Random) -> bytearray:
    at = rng.randrange(len(data))
    del data[at : at + rng.choice((1, 2, 4, 8, rng.randrange(1, 1 + len(data))))]
    return data


def _repeat(data: bytearray, rng: Random) -> bytearray:
    at = rng.randrange(len(data))
    block = data[at : at + rng.choice((1, 4, 16, 200))]
    return data[:at] + block * rng.choice((2, 3, 20, 300)) + data[at:]


def _splice(data: bytearray, rng: Random) -> bytearray:
    a, b = rng.randrange(len(data)), rng.randrange(len(data))
    size = rng.randrange(1, 65)
    data[a : a + size] = data[b : b + size]
    return data


def _insert(data: bytearray, rng: Random) -> bytearray:
    at = rng.randrange(len(data) + 1)
    return data[:at] + rng.randbytes(rng.choice((1, 2, 4, 30))) + data[at:]


def _token(pattern: re.Pattern[bytes], into: tuple[str, ...], data: bytearray, rng: Random) -> bytearray:
    """One of the first few thousand matches becomes something else."""
    start = rng.randrange(max(1, len(data) - 20)) if len(data) > 4000 and rng.random() < 0.5 else 0
    found = [match.span() for match in pattern.finditer(data, start, min(len(data), start + 4000))]
    if not found:
        return _flip(data, rng)
    begin, end = rng.choice(found)
    data[begin:end] = rng.choice(into).encode("utf-8", "surrogatepass")
    return data


def _number(data: bytearray, rng: Random) -> bytearray:
    return _token(_TOKEN, NUMBERS, data, rng)


def _word(data: bytearray, rng: Random) -> bytearray:
    return _token(_WORD, WORDS, data, rng)


def _times(line: bytes, rng: Random) -> int:
    """How often a line is repeated, not much beyond what is kept of the whole."""
    return min(rng.choice((2, 50, 2000)), 2 + MOST // (len(line) + 1))


def _lines(data: bytearray, rng: Random) -> bytearray:
    """Lines dropped, doubled, swapped, joined, or made very long."""
    lines = bytes(data).split(b"\n")
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    how = rng.randrange(6)
    if how == 0:
        del lines[a]
    elif how == 1:
        lines.insert(b, lines[a])
    elif how == 2:
        lines[a], lines[b] = lines[b], lines[a]
    elif how == 3:
        lines[a : a + 2] = [b" ".join(lines[a : a + 2])]
    elif how == 4:
        lines[a] = lines[a] * _times(lines[a], rng)
    else:
        lines[a:a] = [lines[a]] * _times(lines[a], rng)
    return bytearray(b"\n".join(lines))


def _ends(data: bytearray, rng: Random) -> bytearray:
    """Another encoding, or other line ends."""
    how = rng.randrange(5)
    if how == 0:
        return bytearray(bytes(data).replace(b"\n", b"\r\n"))
    if how == 1:
        return bytearray(bytes(data).replace(b"\n", b"\r"))
    if how == 2:
        return bytearray(b"\xef\xbb\xbf" + data)
    if how == 3:
        return bytearray(bytes(data).decode("latin-1").encode("utf-16"))
    return bytearray(bytes(data).replace(b" ", rng.choice((b"\t", b"  ", b"\xc2\xa0", b","))))


_OF_BYTES = (_flip, _flip, _set, _extreme, _extreme, _cut, _behead, _remove, _repeat, _splice, _insert)
_OF_TEXT = (_number, _number, _number, _word, _word, _lines, _lines, _ends)


def mutate_bytes(data: bytes, rng: Random) -> bytes:
    """One to a few mutations of bytes."""
    return _some(data, rng, _OF_BYTES)


def mutate_text(data: bytes, rng: Random) -> bytes:
    """One to a few mutations, most of them of numbers, words and lines."""
    return _some(data, rng, _OF_TEXT if rng.random() < 0.75 else _OF_BYTES)


def _some(data: bytes, rng: Random, ways: tuple) -> bytes:
    for _ in range(rng.choice((1, 1, 1, 2, 3, 6))):
        if not data:
            return rng.randbytes(rng.choice((0, 1, 20)))
        data = bytes(rng.choice(ways)(bytearray(data), rng))[:MOST]
    return data
