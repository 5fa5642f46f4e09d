"""Memory that is used again from frame to frame.

A fresh picture's memory comes from the system page by page, at its first touch: 0.7 ms for 848x480 float32, where a
simple effect takes 0.05 ms.
"""

import threading
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

_OFTEN = 64
"""Frames: memory of a kind that none of so many has taken is given back, such as that of larger pictures."""


class Scratch:
    """Arrays for one frame after another, on one thread: what one frame has taken the next one writes over."""

    def __init__(self) -> None:
        self._kept: dict[tuple[tuple[int, ...], np.dtype[Any]], list[NDArray[Any]]] = {}
        self._taken: dict[tuple[tuple[int, ...], np.dtype[Any]], int] = {}
        self._used: set[tuple[tuple[int, ...], np.dtype[Any]]] = set()
        self._begun, self._looked_back = 0, False
        self._inner: Scratch | None = None

    @classmethod
    def of_thread(cls, own: threading.local) -> "Scratch":
        """This thread's memory, kept as ``own.scratch``, at the beginning of a frame."""
        if not hasattr(own, "scratch"):
            own.scratch = cls()
        scratch: Scratch = own.scratch
        scratch.begin()
        return scratch

    def begin(self) -> None:
        """Begin a frame: all arrays may be taken again."""
        self._taken.clear()
        self._begun += 1
        if self._begun % _OFTEN == 0:
            self._kept = {kind: kept for kind, kept in self._kept.items() if kind in self._used}
            self._used.clear()
            self._inner = self._inner if self._looked_back else None
            self._looked_back = False

    def inner(self) -> "Scratch":
        """Memory for a frame that is made while another one is, begun anew."""
        self._inner, self._looked_back = self._inner or Scratch(), True
        self._inner.begin()
        return self._inner

    def empty(self, shape: tuple[int, ...], dtype: DTypeLike = np.float32) -> NDArray[Any]:
        """An array with arbitrary content, nobody else's until the next :meth:`begin`."""
        kind = shape, np.dtype(dtype)
        kept, taken = self._kept.setdefault(kind, []), self._taken.get(kind, 0)
        if taken == len(kept):
            kept.append(np.empty(shape, dtype))
        self._taken[kind] = taken + 1
        self._used.add(kind)
        return kept[taken]
