"""`./run` installs what a command needs when it first needs it. Here pip is a stand-in: nothing is downloaded."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from recordings import write_run
from sweeps import write_sweep

from depthsim import extras

ROOT = Path(__file__).parents[1]
PIP = """#!/bin/sh
if [ "$1 $2 $3" = "-m pip install" ]; then
    for word in "$@"; do last=$word; done
    echo "$last" >>"$PIP_LOG"
    exec sh -c "$PIP"
fi
[ "$1 $2" = "-m pip" ] || exec "$PYTHON_OF_TESTS" "$@"
"""
DEPTHSIM = """#!/bin/sh
exec "$PYTHON_OF_TESTS" -m depthsim "$@"
"""


class Clone:
    """A copy of `./run`, in a folder with a space, whose environment has the base and no extra."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.venv, self.log = folder, folder / "my venv", folder / "pip.log"
        self.home = folder / "a clone"
        self.home.mkdir(parents=True)
        names = ("run", "requirements.lock", "requirements-test.lock", "pyproject.toml")
        for name in names:
            shutil.copy(ROOT / name, self.home / name)
        (self.venv / "bin").mkdir(parents=True)
        for name, text in {"python": PIP, "depthsim": DEPTHSIM}.items():
            (self.venv / "bin" / name).write_text(text)
            (self.venv / "bin" / name).chmod(0o755)
        pins = b"".join((self.home / name).read_bytes() for name in names[1:])
        (self.venv / ".depthsim-requirements.lock").write_bytes(pins)
        self.log.touch()

    def start(self, *words: str | Path, pip: str = "true", path: Path = ROOT) -> subprocess.Popen[str]:
        keys = {"DEPTHSIM_VENV": self.venv, "PIP_LOG": self.log, "PIP": pip, "PYTHON_OF_TESTS": sys.executable}
        environment = {**os.environ, **{key: str(value) for key, value in keys.items()}}
        environment["PYTHONPATH"] = f"{path}{os.pathsep}{ROOT}"
        pipe = subprocess.PIPE
        return subprocess.Popen(
            [self.home / "run", *map(str, words)], stdout=pipe, stderr=pipe, text=True, cwd=self.folder,
            env=environment, start_new_session=True, preexec_fn=heed_ctrl_c,  # noqa: PLW1509
        )  # fmt: skip

    def run(self, *words: str | Path, pip: str = "true", path: Path = ROOT) -> tuple[int, str, str]:
        with self.start(*words, pip=pip, path=path) as process:
            reported = process.communicate(timeout=100)
        return process.returncode, *reported

    def installed(self) -> list[str]:
        """The last word of every call of pip: what it was to install."""
        return self.log.read_text().splitlines()

    def said(self, extra: str) -> str:
        return f"run: installing the extra '{extra}', which this command needs, into {self.venv}\n"


def heed_ctrl_c() -> None:
    """A shell that starts the tests in the background has them, and all that they start, ignore it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def clone(tmp_path: Path) -> Clone:
    write_run(tmp_path / "office_run")
    write_sweep(tmp_path / "spec")
    (tmp_path / "x.bag").write_bytes(b"#ROSBAG V2.0\n")
    return Clone(tmp_path / "there")


def test_an_extra_is_installed_once_and_the_command_goes_on(clone: Clone) -> None:
    words = ("export", "../office_run", "--to", "ros2", "--out")
    status, out, err = clone.run(*words, "my bag")
    assert (status, err) == (0, clone.said("ros"))
    assert out.startswith("my bag: 6 frames")
    assert clone.installed() == [f"{clone.home}[ros]"]
    assert clone.run(*words, "another")[::2] == (0, "")
    assert clone.installed() == [f"{clone.home}[ros]"]


NEEDS = {
    "export ../office_run --to ros2-sqlite3 --out new": "ros",
    "import ../x.bag --out new": "ros",
    "slam ../office_run --with open3d-slam --out new": "slam",
    "slam ../office_run --sweep --out new": "slam",
    "slam ../office_run --estimate ../office_run/groundtruth.txt --out new": "slam",
    "reconstruct ../office_run --out new": "open3d",
    "sweep ../spec/sweep.yaml --out new": "sweep",
    "sweep ../spec/sweep.yaml --out file:///nowhere/new": "sweep",
    "sweep ../spec/sweep.yaml --out new --ray local": "ray",
}


@pytest.mark.parametrize("words", NEEDS)
def test_without_a_network_nothing_is_half_done(words: str, clone: Clone) -> None:
    before = sorted(clone.folder.rglob("*"))
    extra = NEEDS[words]
    failed = f"run: the extra '{extra}' is not installed; the same command tries again\n"
    assert clone.run(*words.split(), pip="echo no network >&2; exit 1") == (
        2, "", f"{clone.said(extra)}no network\n{failed}",
    )  # fmt: skip
    assert sorted(clone.folder.rglob("*")) == before


def test_ctrl_c_while_an_extra_is_installed_spoils_nothing(clone: Clone) -> None:
    words = ("export", "../office_run", "--to", "ros2", "--out", "bag")
    with clone.start(*words, pip="sleep 60") as process:
        while not clone.installed():
            time.sleep(0.02)
        while process.poll() is None:  # a shell that is about to become `sleep` loses it
            os.killpg(process.pid, signal.SIGINT)
            time.sleep(0.2)
    assert process.returncode in (-signal.SIGINT, 128 + signal.SIGINT)
    assert not (clone.folder / "bag").exists()
    status, _, err = clone.run(*words)
    assert (status, err) == (0, clone.said("ros"))
    assert len(clone.installed()) == 2


def test_what_cannot_be_imported_although_it_is_installed_is_one_line(clone: Clone, tmp_path: Path) -> None:
    (tmp_path / "rosbags.py").write_text("raise ImportError('of another kind of machine')")
    status, out, err = clone.run("export", "../office_run", "--to", "ros2", "--out", "bag", path=tmp_path)
    assert (status, out) == (2, "")
    assert err.startswith(f"{clone.said('ros')}rosbags: rosbags cannot be imported (of another kind of machine); ")
    assert len(err.splitlines()) == 2
    assert len(clone.installed()) == 1


def test_other_pins_are_installed_anew(clone: Clone) -> None:
    words = ("export", "../office_run", "--to", "ros2", "--out")
    assert clone.run(*words, "a")[0] == 0
    with (clone.home / "requirements-test.lock").open("a") as file:
        file.write("# another version\n")
    assert clone.run(*words, "b")[0] == 0
    both = ["requirements.lock", "a clone", "a clone[ros]"]
    assert [Path(word).name for word in clone.installed()] == ["a clone[ros]", *both]


def test_a_larger_extra_has_the_smaller(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(extras.RUN, "run")
    monkeypatch.setenv(extras.EXTRAS, "slam ray")
    for extra in ("slam", "open3d", "ray", "sweep"):
        extras.need_extra(extra)
    with pytest.raises(extras.MissingExtra):
        extras.need_extra("ros")


def test_outside_of_run_the_line_names_a_command_that_works(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a checkout its folder, as depthsim is in no package index; of an installed wheel the packages themselves."""
    monkeypatch.delenv(extras.RUN, raising=False)
    with pytest.raises(extras.MissingExtra) as missing:
        extras.load_extra("rosbags.no_such_module", "ros")
    assert str(missing.value).endswith(f"; install it by `pip install '.[ros]'` in {ROOT}")
    monkeypatch.setattr(extras, "resource", lambda name: tmp_path / name)
    with pytest.raises(extras.MissingExtra) as missing:
        extras.load_extra("rosbags.no_such_module", "ros")
    named = re.search(r"; install it by `pip install (.+)`$", str(missing.value))
    assert named is not None
    assert {word.strip("'").split(">")[0] for word in named[1].split()} == {"rosbags", "mcap"}
