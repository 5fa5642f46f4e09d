"""How numba compiles our kernels: without the GIL, division as the machine has it, and kept on disk."""

from collections.abc import Callable
from typing import Any

from numba import njit

inlined = njit(nogil=True, error_model="numpy", inline="always")
"""For the parts of kernels."""


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` when it is first called, and keep the result for the next start.

    Where neither the package's folder nor the user's can be written, it is compiled anew at every start. numba looks at
    a kernel's own file alone: after a change in a file whose functions other kernels call, delete the ``*.nbi`` files.
    """
    try:
        return njit(nogil=True, cache=True, error_model="numpy")(function)
    except RuntimeError:
        return njit(nogil=True, error_model="numpy")(function)
