"""Arrays of NumPy's .npy and .npz formats from bytes, without pickle, and without memory for what is only promised.

``numpy.load`` asks for all the memory that a header names before it looks whether the data are there, unpacks whatever
a zip holds, and lets the errors of the tokenizer, of zlib and of zipfile out as they are.
"""

import ast
import io
import math
import zipfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError

_MAGIC = b"\x93NUMPY"
_LONGEST_HEADER = 10_000
LARGEST = 1 << 30
"""[bytes] An array in an .npz, unpacked."""


def array_of(data: bytes) -> NDArray:
    """The array of an .npy file: numbers only. Raises ValueError, with what is wrong."""
    if data[:6] != _MAGIC or data[6:7] not in (b"\1", b"\2", b"\3"):
        raise ValueError("it does not begin as an .npy file")
    width = 2 if data[6] == 1 else 4
    begin = 8 + width
    size = int.from_bytes(data[8:begin], "little")
    if size > min(_LONGEST_HEADER, len(data)):
        raise ValueError("its header is cut off")
    kind, shape, fortran = _header(data[begin : begin + size])
    count = math.prod(shape)
    body = memoryview(data)[begin + size :]
    if len(body) < count * kind.itemsize:
        raise ValueError(f"it ends before the {'x'.join(map(str, shape))} values of its header")
    flat = np.frombuffer(body, kind, count)
    return flat.reshape(shape, order="F" if fortran else "C").astype(kind.newbyteorder("="))


def _header(text: bytes) -> tuple[np.dtype, tuple[int, ...], bool]:
    try:
        keys = ast.literal_eval(text.decode("latin-1").strip())
        kind, shape, fortran = np.dtype(keys["descr"]), keys["shape"], keys["fortran_order"]
    except (SyntaxError, ValueError, TypeError, KeyError, RecursionError, MemoryError):
        raise ValueError("its header cannot be read") from None
    if (
        not isinstance(shape, tuple)
        or len(shape) > 32
        or not all(type(side) is int and 0 <= side < 1 << 40 for side in shape)
    ):
        raise ValueError("its header has no shape")
    if kind.kind not in "biuf":
        raise ValueError(f"it holds {kind}, not numbers")
    return kind, shape, bool(fortran)


def arrays_of(data: bytes, names: tuple[str, ...]) -> list[NDArray]:
    """Some arrays of an .npz file, by their names. Raises ValueError, with what is wrong."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            return [array_of(_member(archive, f"{name}.npy")) for name in names]
    except ValueError:
        raise
    except Exception as error:  # zipfile and zlib have no common base class, and raise NotImplementedError and more
        raise ValueError(" ".join(str(error).split()) or type(error).__name__) from None


def _member(archive: zipfile.ZipFile, name: str) -> bytes:
    if archive.getinfo(name).file_size > LARGEST:
        raise ValueError(f"{name} is larger than {LARGEST >> 20} MB")
    with archive.open(name) as file:
        return file.read(LARGEST)


def load_npy(file: Path) -> NDArray:
    """The array of an .npy file; :class:`InputError` where it is none."""
    try:
        return array_of(file.read_bytes())
    except (OSError, ValueError) as error:
        raise InputError(file, "", f"is no whole .npy ({error})", "write it by numpy.save") from None
