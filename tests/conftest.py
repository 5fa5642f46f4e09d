"""Set up before any test module is read."""

import gc
import hashlib
import os
from pathlib import Path

from hypothesis import settings

_ROOT = Path(__file__).parents[1]


def _digest() -> str:
    """A name for the state of all kernels."""
    digest = hashlib.blake2b(digest_size=8)
    for file in sorted((_ROOT / "depthsim").rglob("*.py")):
        text = file.read_bytes()
        if b"numba" in text:
            digest.update(text)
    return digest.hexdigest()


# numba asks only whether the file of a cached kernel has changed, and not those of the functions that the kernel calls
# (draws.py, llvm.py). With a cache for every state of the code the tests never see a kernel of yesterday.
os.environ.setdefault("NUMBA_CACHE_DIR", str(_ROOT / ".pytest_cache" / "numba" / _digest()))

# As the command line does, and before numpy is imported: the kernels have the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# Containers often tell Python to keep no bytecode. Each of the hundreds of processes that the tests start would compile
# the package anew, for a third of a second.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# A property that is drawn first may wait for its kernel to be compiled, and these machines are noisy: none is timed.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


def pytest_collection_finish() -> None:
    """What has been imported stays: look for garbage without it, and let forked processes share it."""
    gc.freeze()
