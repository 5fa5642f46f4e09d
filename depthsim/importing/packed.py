"""Unpacking and reading what a bag holds, within plain limits of size.

rosbags and mcap have none; what they are given whole is as trusted as any other program that the user runs.
"""

import bz2
import io
from collections.abc import Callable
from typing import Any, BinaryIO

from depthsim.extras import load_extra

LARGEST_CHUNK = 1 << 28
"""[bytes] Unpacked. The chunks of rosbag have 768 kB, those of rosbag2 a few MB."""


def unpack(how: str, data: bytes) -> bytes:
    """What a chunk unpacks to; ``how`` is none, bz2, lz4 or zstd, or empty for none.

    Raises ValueError for what cannot be unpacked, or is more than a chunk can be.
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
        raise ValueError(f"unpacks to more than {LARGEST_CHUNK >> 20} MB")
    if not unpacker.eof:
        raise ValueError("cannot be unpacked whole")
    return plain


def _lz4() -> Any:
    return load_extra("lz4.frame", "ros").LZ4FrameDecompressor()


def _zstd() -> Any:
    return load_extra("backports.zstd", "ros").ZstdDecompressor()


_UNPACKERS: dict[str, Callable[[], Any]] = {"bz2": bz2.BZ2Decompressor, "lz4": _lz4, "zstd": _zstd}


def read_at_most(file: BinaryIO, length: int) -> bytes:
    """So many bytes, or what there is: memory is not asked for before it is known that they are there."""
    here = file.tell()
    there = file.seek(0, io.SEEK_END) - here
    file.seek(here)
    return file.read(max(0, min(length, there)))
