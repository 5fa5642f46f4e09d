"""Open3D, which is an extra: loaded on demand, with the libusb that it needs on a machine that has none."""

import ctypes
import importlib
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType

from depthsim.extras import MissingExtra, need_extra


def load_open3d() -> ModuleType:
    """The module ``open3d``, or a :class:`MissingExtra`."""
    need_extra("open3d")
    try:
        import libusb_package

        # Open3D asks the loader for libusb-1.0 by name: it takes the one that is already there for all to see.
        ctypes.CDLL(str(libusb_package.get_library_path()), ctypes.RTLD_GLOBAL)
    except (ImportError, OSError):
        pass  # then the machine's own libusb has to do
    try:
        with _without_ctrl_c():
            return importlib.import_module("open3d")
    except (ImportError, OSError) as error:
        problem = f"Open3D cannot be imported ({error})"
        raise MissingExtra("open3d", problem, "open3d") from None


@contextmanager
def _without_ctrl_c() -> Iterator[None]:
    """Ctrl-C waits: Open3D, broken off as it loads, prints what it calls leaks at the end, and exits by 1."""
    before = signal.getsignal(signal.SIGINT)
    if not callable(before) or threading.current_thread() is not threading.main_thread():
        yield
        return
    pressed: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: pressed.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if pressed:
        before(signal.SIGINT, None)
