"""Open3D, which is an extra: loaded on demand, with the libusb that it needs on a machine that has none."""

import ctypes
import importlib
from types import ModuleType

from depthsim.errors import InputError


def load_open3d() -> ModuleType:
    """The module ``open3d``; an :class:`InputError` that names the extra where it cannot be imported."""
    try:
        import libusb_package

        # Open3D asks the loader for libusb-1.0 by name: it takes the one that is already there for all to see.
        ctypes.CDLL(str(libusb_package.get_library_path()), ctypes.RTLD_GLOBAL)
    except (ImportError, OSError):
        pass  # then the machine's own libusb has to do
    try:
        return importlib.import_module("open3d")
    except (ImportError, OSError) as error:
        problem = f"Open3D cannot be imported ({error})"
        raise InputError("open3d", "", problem, "install it by `pip install 'depthsim[open3d]'`") from None
