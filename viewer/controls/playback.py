"""Which frame: a slider, play, and how fast. Time runs by the clock, and frames that cannot be shown are left out."""

import time
from collections.abc import Callable

import numpy as np
import viser
from numpy.typing import NDArray

from viewer.controls.handles import picked, put

_SPEEDS = {"1/8": 0.125, "1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0, "4": 4.0, "8": 8.0}


class Playback:
    """stamps: (N,) of the frames [s]."""

    def __init__(self, gui: viser.GuiApi, stamps: NDArray[np.float64], changed: Callable[[], None]) -> None:
        self._stamps = stamps
        self._begin: tuple[float, float] | None = None
        self._slider = gui.add_slider("frame", 0, max(len(stamps) - 1, 1), 1, 0, disabled=len(stamps) < 2)
        self._play = gui.add_checkbox("play", False, hint="Also by the key K; J and L go a frame back and on.")
        self._speed = gui.add_dropdown("speed", list(_SPEEDS), initial_value="1", hint="Against the clock.")
        self._moving, self._shown = False, -1
        self._slider.on_update(lambda _: None if self._moving else changed())
        self._play.on_update(lambda _: self._rewind(changed))
        self._speed.on_update(lambda _: self._rewind(changed))
        gui.add_command("One frame back", hotkey="J").on_trigger(lambda _: self.go_to(self.index - 1))
        gui.add_command("One frame on", hotkey="L").on_trigger(lambda _: self.go_to(self.index + 1))
        gui.add_command("Play or pause", hotkey="K").on_trigger(lambda _: self.toggle())

    def set_stamps(self, stamps: NDArray[np.float64]) -> None:
        """Another path: begin at its first frame."""
        self._stamps, self._begin = stamps, None
        put(self._slider, 0)
        self._slider.max = max(len(stamps) - 1, 1)
        self._slider.disabled = len(stamps) < 2

    @property
    def index(self) -> int:
        """The frame to show."""
        return min(int(self._slider.value), len(self._stamps) - 1)

    @property
    def playing(self) -> bool:
        """Whether time runs."""
        return bool(self._play.value) and len(self._stamps) > 1

    @property
    def rate(self) -> float:
        """Frames a second that go by while it plays."""
        length = float(self._stamps[-1] - self._stamps[0])
        return (len(self._stamps) - 1) / length * _SPEEDS[picked(self._speed)] if length > 0 else 1.0

    def toggle(self) -> None:
        """Play, or pause."""
        put(self._play, not self._play.value)

    def go_to(self, index: int) -> None:
        """Show another frame."""
        self._begin = None
        put(self._slider, min(max(index, 0), len(self._stamps) - 1))

    def _rewind(self, changed: Callable[[], None]) -> None:
        self._begin = None
        changed()

    def advance(self) -> None:
        """Go to the frame that the clock asks for; after the last comes the first."""
        now = time.monotonic()
        first, last = float(self._stamps[0]), float(self._stamps[-1])
        if self._begin is None or self._shown != self.index:  # begun, or scrubbed meanwhile
            self._begin = now, float(self._stamps[self.index])
        gone = (now - self._begin[0]) * _SPEEDS[picked(self._speed)]
        length = last - first + (last - first) / (len(self._stamps) - 1)
        stamp = first + (self._begin[1] - first + gone) % length
        self._shown = max(int(self._stamps.searchsorted(stamp + 1e-9, side="right")) - 1, 0)
        self._moving = True
        put(self._slider, self._shown)
        self._moving = False
