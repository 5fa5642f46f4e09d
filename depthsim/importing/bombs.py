"""What no bag of a recording holds, and what would fill the memory or never end: found before a bag is read.

A hundred kilobytes can be packed so that they unpack to a terabyte, and in an SQLite file a table can be a view that is
computed without end. rosbags and mcap unpack and ask without bound.
"""

import bz2
import io
import os
import sqlite3
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from depthsim.errors import InputError
from depthsim.extras import load_extra
from depthsim.yamlfile import read_mapping

LARGEST_CHUNK = 1 << 28
"""[bytes] Unpacked. The chunks of rosbag have 768 kB, those of rosbag2 a few MB."""
_CHUNK = 6
_TABLES = ("topics", "messages", "schema", "metadata", "message_definitions")


class Bomb(ValueError):
    """Something unpacks to far more than it may."""


def unpack(how: str, data: bytes) -> bytes:
    """What a chunk unpacks to; ``how`` is none, bz2, lz4 or zstd, or empty for none.

    Raises :class:`Bomb` where that is more than a chunk can be, and ValueError for what cannot be unpacked.
    """
    if how in ("", "none"):
        return data
    try:
        unpacker = _UNPACKERS[how]()
    except KeyError:
        raise ValueError(f"is in the unknown compression {how[:20]!r}") from None
    try:
        plain = bytes(unpacker.decompress(data, max_length=LARGEST_CHUNK))
    except Exception as error:  # OSError, RuntimeError, ZstdError: the three have no common base class
        raise ValueError("cannot be unpacked") from error
    if len(plain) >= LARGEST_CHUNK:
        raise Bomb(f"unpacks to more than {LARGEST_CHUNK >> 20} MB")
    if not unpacker.eof:
        raise ValueError("cannot be unpacked whole")
    return plain


def _lz4() -> Any:
    return load_extra("lz4.frame", "ros").LZ4FrameDecompressor()


def _zstd() -> Any:
    return load_extra("backports.zstd", "ros").ZstdDecompressor()


_UNPACKERS: dict[str, Callable[[], Any]] = {"bz2": bz2.BZ2Decompressor, "lz4": _lz4, "zstd": _zstd}


def why_unsafe(file: Path) -> str | None:
    """Why a .mcap, .db3 or metadata.yaml must not be given to rosbags, None where nothing speaks against it."""
    try:
        if file.suffix.lower() == ".mcap":
            return _mcap(file)
        if file.suffix.lower() == ".db3":
            return odd_scheme(file)
        if file.suffix.lower() == ".zstd":
            return _zstd_file(file)
        if file.name == "metadata.yaml":
            read_mapping(file, "a metadata.yaml")
    except InputError as error:
        return str(error)
    except (OSError, struct.error, UnicodeDecodeError):
        pass  # damaged: the readers will say where
    return None


def _mcap(path: Path) -> str | None:
    """Whether a chunk unpacks to too much. Everything but the chunks is passed over."""
    with path.open("rb") as file:
        file.seek(8)
        while len(head := file.read(9)) == 9:
            op, length = struct.unpack("<BQ", head)
            next_record = file.tell() + length
            if op == _CHUNK:
                try:
                    unpack(*_chunk(file, length))
                except Bomb as bomb:
                    return f"has a chunk that {bomb}"
                except ValueError:
                    return None
            if next_record > 1 << 62:
                return None
            file.seek(next_record)
    return None


def _chunk(file: BinaryIO, length: int) -> tuple[str, bytes]:
    """The compression of an MCAP chunk and what is in it; data that is not compressed is not read."""
    (size,) = struct.unpack("<28xI", file.read(32))
    how = file.read(min(size, 100)).decode()
    (packed,) = struct.unpack("<Q", file.read(8))
    return how, b"" if how == "" else file.read(min(packed, length, os.fstat(file.fileno()).st_size))


def _zstd_file(path: Path) -> str | None:
    """Whether a file packed as a whole unpacks to a hundred times its size, and more than a chunk may have."""
    module = load_extra("backports.zstd", "ros")
    most, total = 100 * path.stat().st_size + LARGEST_CHUNK, 0
    try:
        with path.open("rb") as packed, module.open(packed, "rb") as plain:
            while block := plain.read(1 << 20):
                total += len(block)
                if total > most:
                    return "unpacks to more than a hundred times its size"
    except (module.ZstdError, EOFError):
        pass
    return None


def odd_scheme(path: Path) -> str | None:
    """Whether the tables of an SQLite file are anything else than tables of what was recorded."""
    try:
        base = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
    except sqlite3.Error:
        return None
    base.text_factory = lambda text: text.decode(errors="replace")  # what SQLite can read, this can
    try:
        base.execute("PRAGMA writable_schema=ON")  # else SQLite refuses a file that is shorter than it was
        for kind, name, text in base.execute("SELECT type, name, sql FROM sqlite_master"):
            words = str(text).upper().replace("(", " ").split()
            if kind in ("view", "trigger") or "VIRTUAL" in words or (name in _TABLES and "AS" in words):
                return "computes its messages instead of holding them"
    except sqlite3.Error:
        pass  # damaged
    finally:
        base.close()
    return None


def read_at_most(file: BinaryIO, length: int) -> bytes:
    """So many bytes, or what there is: memory is not asked for before it is known that they are there."""
    here = file.tell()
    there = file.seek(0, io.SEEK_END) - here
    file.seek(here)
    return file.read(max(0, min(length, there)))
