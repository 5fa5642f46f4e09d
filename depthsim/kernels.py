"""How numba compiles our kernels: without the GIL, division as the machine has it, and kept on disk."""

import logging
from collections.abc import Callable
from typing import Any

from numba import njit
from numba.core import event
from numba.core.caching import FunctionCache
from numba.core.runtime import rtsys

_log = logging.getLogger(__name__)


def _leave_blas_alone() -> None:
    """Let numba load its mathematics of arrays without SciPy, which it asks for BLAS at every start, for 0.2 s.

    A kernel that multiplies matrices asks again when it is compiled, and needs the answer then.
    """
    from numba.np import linalg

    ask = getattr(linalg, "ensure_blas", None)
    if ask is None:  # another numba, which may not ask
        return
    linalg.ensure_blas = lambda: None
    try:
        from numba.np import arraymath  # noqa: F401
    finally:
        linalg.ensure_blas = ask


_leave_blas_alone()


class _Cache(FunctionCache):
    """numba's own, but what numba knows to compile is not read for what is compiled: 0.07 s less at every start."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """What was compiled for ``sig``, or None; the compiler itself reads all that it needs when it begins.

        numba holds its one lock around this.
        """
        rtsys.initialize(target_context)  # kernels ask it for memory
        target_context.refresh = lambda: None
        try:
            return super().load_overload(sig, target_context)
        finally:
            vars(target_context).pop("refresh", None)  # what is unpickled may have been here itself


inlined = njit(nogil=True, error_model="numpy", inline="always")
"""For the parts of kernels."""


def kernel(function: Callable[..., Any]) -> Any:
    """Compile ``function`` when it is first called, and keep the result for the next start.

    Where neither the package's folder nor the user's can be written, it is compiled anew at every start. numba looks at
    a kernel's own file alone: after a change in a file whose functions other kernels call, delete the ``*.nbi`` files.

    The compiler makes vectors of a loop over pixels, which is three to ten times as fast, only if each turn reads all
    that it needs first and then chooses, one choice a line: no branch, no read within a choice, no ``&`` of comparisons
    of floats, and no read from a small array that might be what the loop writes.
    """
    compiled: Any = njit(nogil=True, error_model="numpy")(function)
    try:
        compiled._cache = _Cache(function)
    except RuntimeError:
        _watch.how_often = "at every start, as nowhere can be written (NUMBA_CACHE_DIR names a folder)"
    return compiled


class _Watch(event.Listener):
    """Logs, once a process, that kernels are compiled: numba reports it only where its cache has none."""

    how_often = "once"
    _logged = False

    def on_start(self, event: Any) -> None:
        """Called as a compilation begins; it may be one that another package has asked for."""
        if not self._logged and event.data["dispatcher"].py_func.__module__.partition(".")[0] == "depthsim":
            self._logged = True
            _log.info("compiling kernels for this processor, %s; this may take 20 s", self.how_often)

    def on_end(self, event: Any) -> None:
        """Called as it ends."""


_watch = _Watch()
event.register("numba:compile", _watch)
