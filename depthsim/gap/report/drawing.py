"""What the pictures of a report are made from, kept beside it: it can be drawn again without simulating again."""

import base64
import zlib
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, PlainSerializer, PlainValidator

from depthsim.runs.storing import write_whole
from depthsim.yamlfile import read_text

DRAWING = "drawing.json"
_MOST_BYTES = 64_000_000
"""No array of a report is nearly as large."""


def _to_json(array: NDArray[Any]) -> dict[str, Any]:
    data = base64.b64encode(zlib.compress(np.ascontiguousarray(array).tobytes(), 6)).decode()
    return {"type": array.dtype.str, "shape": list(array.shape), "data": data}


def _from_json(value: Any) -> NDArray[Any]:
    if isinstance(value, np.ndarray):
        return value
    try:
        kind, shape = np.dtype(value["type"]), tuple(int(n) for n in value["shape"])
        raw = zlib.decompressobj().decompress(base64.b64decode(value["data"]), _MOST_BYTES)
        return np.frombuffer(raw, kind).reshape(shape)
    except (KeyError, TypeError, zlib.error, OverflowError) as error:
        raise ValueError(f"is not an array of a drawing ({error})") from None


Array = Annotated[Any, PlainValidator(_from_json), PlainSerializer(_to_json)]
"""A numpy array; in JSON its type, its shape, and its bytes, compressed."""


class Drawn(BaseModel):
    """A part of what is drawn."""

    model_config = ConfigDict(extra="forbid", frozen=True)


def write_drawing(drawing: Drawn, folder: Path) -> None:
    """Write drawing.json into ``folder``, whole or not at all."""
    write_whole(folder / DRAWING, drawing.model_dump_json().encode())


def read_drawing(folder: Path) -> str:
    """The text of drawing.json. Raises :class:`InputError` where there is none."""
    return read_text(folder / DRAWING, "a drawing.json")
