"""That kernels are compiled is reported at a terminal, once; and nowhere else."""

import logging
import os
import pty
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from depthsim import kernels
from depthsim.sweep.pool import Pool
from depthsim.sweep.worker import Notes

LINE = "compiling kernels for this processor, once; this may take 20 s"
TINY = """
import sys
import depthsim.cli

def tiny() -> None:
    import numpy as np
    from depthsim.sensor.effects.limits import keep_between
    for kind in (np.float32, np.float64):
        keep_between(0, 2, kind(0), kind(1), np.ones(2, kind))
    print("done")

depthsim.cli.app.command("tiny")(tiny)
sys.argv[1:] = ["tiny"]
from depthsim.__main__ import main
main()
"""
"""A command with two kernels that compile at once."""


def at_terminal(*words: str | Path, cache: Path) -> str:
    """All that a command prints where its standard error is a terminal."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache), "TERM": "dumb"}
    with subprocess.Popen([sys.executable, *map(str, words)], stdout=theirs, stderr=theirs, env=environment) as process:
        os.close(theirs)
        reported = b""
        try:
            while part := os.read(ours, 1 << 16):
                reported += part
        except OSError:  # of Linux, where the other end is closed
            pass
    os.close(ours)
    assert process.returncode == 0, reported.decode()
    return (
        reported.decode().replace("\r\n", "\n").removesuffix("\x1b[0m")
    )  # by colorama, which numba uses if it is there


def test_it_is_reported_once_and_not_on_the_next_start(tmp_path: Path) -> None:
    assert at_terminal("-c", TINY, cache=tmp_path) == f"{LINE}\ndone\n"
    assert at_terminal("-c", TINY, cache=tmp_path) == "done\n"


def test_what_is_compiled_is_loaded_without_what_numba_compiles_by(tmp_path: Path) -> None:
    code = "import atexit, sys; atexit.register(lambda: print('numba.np.npyimpl' in sys.modules))" + TINY
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    starts = [
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=True)
        for _ in range(2)
    ]
    assert [start.stdout for start in starts] == ["done\nTrue\n", "done\nFalse\n"]


def test_what_is_read_by_a_program_has_no_such_line(tmp_path: Path) -> None:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    made = subprocess.run([sys.executable, "-c", TINY], capture_output=True, text=True, env=environment, check=True)
    assert (made.stdout, made.stderr) == ("done\n", "")


def test_where_nothing_can_be_kept_the_line_says_so(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def nowhere(function: Any) -> Any:
        raise RuntimeError("no locator available")  # as numba says it

    monkeypatch.setattr(kernels, "_Cache", nowhere)
    monkeypatch.setattr(kernels._watch, "how_often", "once")
    monkeypatch.setattr(kernels._watch, "_logged", False)

    def double(x: int) -> int:
        return 2 * x

    double.__module__ = "depthsim.of_this_test"
    with caplog.at_level(logging.INFO, "depthsim"):
        assert kernels.kernel(double)(2) == 4
    assert caplog.messages == [
        LINE.replace("once", "at every start, as nowhere can be written (NUMBA_CACHE_DIR names a folder)")
    ]


WORKER = """#!/bin/sh
echo '{"kind": "note", "text": "as every worker says"}'
exec sleep 60
"""


def test_what_all_workers_log_is_logged_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    program = tmp_path / "worker"
    program.write_text(WORKER)
    program.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(program))
    pool = Pool("nowhere", 2)
    heard: list[str] = []
    monkeypatch.setattr(pool, "_note", lambda text, note=pool._note: (heard.append(text), note(text)))
    with caplog.at_level(logging.INFO, "depthsim"):
        while len(heard) < 2:
            assert pool.wait(10) == []
    pool.close()
    assert caplog.messages == ["as every worker says"]


def test_a_worker_sends_what_is_logged() -> None:
    sent: list[dict[str, Any]] = []
    log = logging.getLogger("depthsim.of_this_test")
    notes = Notes(sent.append)
    log.addHandler(notes)
    log.warning("%s times", "two")
    log.removeHandler(notes)
    assert sent == [{"kind": "note", "text": "two times"}]
