"""Ctrl-C at any moment: one line that says what is kept, and exit status 130."""

import importlib.util
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

KEPT = "stopped; whole frames are kept, and the same command goes on from there\n"
CTRL_C_AS_A_MODULE_LOADS = """
import signal, sys
from importlib.abc import MetaPathFinder

class CtrlC(MetaPathFinder):
    def find_spec(self, name, path, target=None):
        if name != {module!r}:
            return None
        sys.meta_path.remove(self)
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt:
            raise {error}

signal.signal(signal.SIGINT, signal.default_int_handler)
sys.meta_path.insert(0, CtrlC())
"""


def ctrl_c(module: str, then: str, error: str = "") -> tuple[int, str, str]:
    """Status, stdout and stderr of a process that is sent Ctrl-C as it comes to load a module."""
    code = CTRL_C_AS_A_MODULE_LOADS.format(module=module, error=error) + then
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    return result.returncode, result.stdout, result.stderr


def command(*words: str | Path) -> str:
    argv = ["depthsim", *map(str, words)]
    return f"sys.argv[:] = {argv!r}\nfrom depthsim.__main__ import main\nmain()"


@pytest.mark.parametrize("error", ["", "RuntimeError('of Ctrl-C')", "InputError('file', '', 'is damaged', 'fix it')"])
@pytest.mark.parametrize("module", ["typer", "numpy"])
def test_as_the_command_starts(module: str, error: str, tmp_path: Path) -> None:
    """Python wraps an interrupt in the making of a class, and a reader of a file may take it for damage."""
    then = "from depthsim.errors import InputError\n" + command("generate", "office", "--out", tmp_path / "run")
    assert ctrl_c(module, then, error) == (130, "", KEPT)


def test_a_command_that_keeps_nothing_says_no_more() -> None:
    assert ctrl_c("depthsim.scenefile", command("inspect", "office")) == (130, "", "stopped\n")


LOADS_OPEN3D = """
import signal, sys, time
import numpy
from depthsim.open3d_loader import load_open3d
signal.signal(signal.SIGINT, signal.default_int_handler)
try:
    print("loads", flush=True)
    load_open3d()
    time.sleep(60)
except KeyboardInterrupt:
    sys.exit(130)
"""


@pytest.mark.parametrize("delay", [0.05, 0.1, 0.2])
def test_as_open3d_loads(delay: float) -> None:
    """Broken off as it loads, it cannot be imported, or ends the process by 1 and a page of what it takes for leaks."""
    if importlib.util.find_spec("open3d") is None:
        pytest.skip("the open3d wheel is not installed: pip install '.[open3d]'")
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "-c", LOADS_OPEN3D], stdout=pipe, stderr=pipe, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "loads\n"
        time.sleep(delay)
        process.send_signal(signal.SIGINT)
        reported = process.communicate(timeout=60)
    assert (process.returncode, *reported) == (130, "", "")
