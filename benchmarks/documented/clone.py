"""A copy of the checkout in which the pages' command lines are run."""

import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import urllib.request
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

from benchmarks.documented.inputs import make_inputs, write_yaml
from benchmarks.documented.lines import Line
from benchmarks.documented.table import How, Step, step_of

ROOT = Path(__file__).resolve().parents[2]
LOCKS = ("requirements.lock", "requirements-test.lock", "pyproject.toml")
PATIENCE = 600.0
"""[s] A line that takes longer hangs, where time is short."""


def pages(root: Path = ROOT) -> list[Path]:
    """All Markdown at the root and under docs/, README.md first."""
    return [root / "README.md", *sorted({*root.glob("*.md"), *root.glob("docs/**/*.md")} - {root / "README.md"})]


@dataclass(frozen=True)
class Outcome:
    """What became of a line. seconds: of the processor. fault: empty if it went as it should."""

    step: Step
    seconds: float
    fault: str


def _made_here() -> list[str]:
    """Runs and reports that were made in the checkout, by the same command lines."""
    return [path.parent.name for name in ("run.yaml", "diagnosis.json") for path in ROOT.glob(f"*/{name}")]


class Clone:
    """The checkout's files but its packages, with programs on the path that a reader has.

    home: an empty folder. venv: where `./run` sets itself up; None for a stand-in that holds all that this Python has,
    so that nothing is downloaded. `depthsim` and `python` are what `./run` runs.
    """

    def __init__(self, home: Path, venv: Path | None = None) -> None:
        self.home, self.short = home / "depthsim", venv is None
        tools = home / "bin"
        tools.mkdir(parents=True)
        if venv is None:
            self.venv = home / "venv"
            # numba keeps its kernels by the place of their files: those of a copy would all be compiled anew.
            ignore = shutil.ignore_patterns(".*", "__pycache__", "tests", "depthsim", "viewer", *_made_here())
            shutil.copytree(ROOT, self.home, ignore=ignore)
            self._stand_in()
        else:
            self.venv = venv
            subprocess.run(["git", "clone", "-q", str(ROOT), str(self.home)], check=True)
        run, python = shlex.quote(str(self.home / "run")), shlex.quote(str(self.venv / "bin" / "python"))
        calls = {"depthsim": run, "python": f"{run} python", "pip": f"{python} -m pip"}
        for name, call in calls.items():
            _program(tools / name, call)
        path = f"{tools}{os.pathsep}{os.environ['PATH']}"
        self._environment = {**os.environ, "DEPTHSIM_VENV": str(self.venv), "PATH": path, "COLUMNS": "200"}
        if not self.short:
            self._environment.pop("PYTHONPATH", None)
        for page in pages():
            for text in _yaml(page):
                write_yaml(text, self.home)

    def _stand_in(self) -> None:
        (self.venv / "bin").mkdir(parents=True)
        python = shlex.quote(sys.executable)
        _program(self.venv / "bin" / "python", python)
        _program(self.venv / "bin" / "depthsim", f"{python} -c 'from depthsim.__main__ import main; main()'")
        pins = b"".join((ROOT / name).read_bytes() for name in LOCKS)
        for name in LOCKS[:2]:
            (self.venv / f".depthsim-{name}").write_bytes(pins)

    def run(self, line: Line) -> Outcome:
        """Run a line as the table says."""
        step, begin = step_of(line, self.short), _processor_time()
        fault = "" if step.how is How.LEAVE else self._run(step)
        return Outcome(step, _processor_time() - begin, fault)

    def _run(self, step: Step) -> str:
        make_inputs(step.text, self.home)
        for line in step.first:
            subprocess.run(line, shell=True, cwd=self.home, check=True)
        text = step.text
        if step.how is How.SERVE:  # no shell that Ctrl-C ends by a signal, and none that started us with it ignored
            text = f"exec env --default-signal=INT {text}"
        process = subprocess.Popen(
            text, shell=True, cwd=self.home, env=self._environment, text=True, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        )  # fmt: skip
        try:
            if step.how is How.SERVE:
                return _serve(process)
            said, _ = process.communicate(timeout=PATIENCE if self.short else None)
        except subprocess.TimeoutExpired:
            return f"did not end in {PATIENCE:g} s"
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        if re.search(r"depthsim \S+ does not provide the extra", said):  # what packages of others lack is their own
            return said.strip()
        return "" if process.returncode == 0 else f"exit status {process.returncode}: {said.strip()[-1500:]}"


def _serve(process: "subprocess.Popen[str]") -> str:
    """Wait for the page that a line shows, get it, and press Ctrl-C."""
    assert process.stdout is not None
    said = ""
    for line in process.stdout:
        said += line
        if url := re.search(r"http://\S+", said):
            with urllib.request.urlopen(url[0], timeout=60) as answer:
                page = answer.status
            os.killpg(process.pid, signal.SIGINT)
            process.communicate(timeout=PATIENCE)
            return "" if (page, process.returncode) == (200, 0) else f"page {page}, exit status {process.returncode}"
    return f"showed no page: {said.strip()[-1500:]}"


def _processor_time() -> float:
    """[s] Of this process and all that it has waited for."""
    return sum(os.times()[:4])


def _program(file: Path, call: str) -> None:
    file.write_text(f'#!/bin/sh\nexec {call} "$@"\n')
    file.chmod(0o755)


def _yaml(page: Path) -> Iterator[str]:
    for token in MarkdownIt("commonmark").parse(page.read_text()):
        if token.type == "fence" and token.info in ("yaml", "yml"):
            yield token.content
