"""Sweeps at URLs: the bytes of a local one, frames sent as they are made, and a lease that no clock can break."""

import json
import os
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from sweeps import SWEEP, Here, tree, write_sweep

from depthsim.errors import InputError
from depthsim.sweep import lease as leases
from depthsim.sweep.drive import run_sweep
from depthsim.sweep.events import Event, Job, lost
from depthsim.sweep.lease import Lease
from depthsim.sweep.pool import Pool
from depthsim.sweep.remote import FsspecTarget, _state
from depthsim.sweep.show import State
from depthsim.sweep.target import LocalTarget, open_target


@pytest.fixture
def url() -> Iterator[str]:
    """A folder of fsspec's memory, in this process alone."""
    import fsspec

    name = f"memory://{uuid.uuid4().hex}"
    yield name
    with suppress(FileNotFoundError):
        fsspec.filesystem("memory").rm(name, recursive=True)


@pytest.fixture(scope="module")
def local(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("local")
    target = LocalTarget(folder / "out")
    run_sweep(write_sweep(folder / "spec"), target, lambda plan: Here(plan, target))
    return folder


def downloaded(url: str, folder: Path) -> Path:
    import fsspec

    files, root = fsspec.core.url_to_fs(url)
    files.get(root, str(folder), recursive=True)
    return folder


def test_memory_holds_the_bytes_of_a_folder(local: Path, url: str, tmp_path: Path) -> None:
    target = open_target(url)
    done = run_sweep(local / "spec/sweep.yaml", target, lambda plan: Here(plan, target))
    assert (done.whole, done.frames_made) == (16, 48)
    assert tree(downloaded(url, tmp_path / "copy")) == tree(local / "out")
    again = run_sweep(local / "spec/sweep.yaml", open_target(url), lambda plan: pytest.fail("nothing is missing"))
    assert again.whole == 16


def test_workers_write_to_a_url(local: Path, tmp_path: Path) -> None:
    target = open_target(f"file://{tmp_path}/out")
    assert isinstance(target, FsspecTarget)
    done = run_sweep(local / "spec/sweep.yaml", target, lambda plan: Pool(target.url, 2))
    assert done.whole == 16
    assert tree(tmp_path / "out") == tree(local / "out")
    state = State.read(target.url)
    assert "16 whole (100.0%)" in state.text()
    with state.open_run(3) as run:
        assert len(run) == 3


def test_a_lost_node_costs_the_frames_in_flight(local: Path, url: str, tmp_path: Path) -> None:
    target = open_target(url)
    killed: list[int] = []

    def start(plan: object) -> Here:
        makers = Here(plan, target)  # type: ignore[arg-type]

        def spoil(job: Job) -> Event | None:
            if job.run != 2 or killed:
                return None
            killed.append(job.run)

            def die(done: int, total: int) -> None:
                if done == 2:
                    raise KeyboardInterrupt

            with pytest.raises(KeyboardInterrupt):
                makers.maker.make(job.run, progress=die)
            return lost(job.run, "its node went")

        makers._spoil = spoil
        return makers

    done = run_sweep(local / "spec/sweep.yaml", target, start)
    assert (done.whole, done.lost) == (16, 1)
    assert done.frames_made in (45, 46), "two frames were there before the node went, or the third as well"
    assert tree(downloaded(url, tmp_path / "copy")) == tree(local / "out")


def test_damage_is_mended_at_a_url(local: Path, url: str, tmp_path: Path) -> None:
    target = open_target(url)
    run_sweep(local / "spec/sweep.yaml", target, lambda plan: Here(plan, target))
    name = "runs/000/000004/depth/0.033333.png"
    data = bytearray(target.read(name) or b"")
    data[60] ^= 8
    target.write(name, bytes(data))
    done = run_sweep(local / "spec/sweep.yaml", target, lambda plan: Here(plan, target), check=True)
    assert (done.repaired, done.frames_made) == (1, 1)
    assert tree(downloaded(url, tmp_path / "copy")) == tree(local / "out")


def test_a_file_that_is_written_anew_is_another_whatever_its_inode_and_size(tmp_path: Path) -> None:
    file = tmp_path / "frame.png"
    file.write_bytes(b"damaged")
    before = _state(file)
    with file.open("r+b") as same:  # as where a file system gives the inode of a file that was taken away
        same.write(b"whole..")
    os.utime(file, ns=(0, file.stat().st_mtime_ns + 4_000_000))
    assert _state(file) != before and _state(file)[:2] == before[:2]


def test_a_second_driver_at_a_url_is_refused(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(leases, "BEAT", 0.05)
    first, second = FsspecTarget(url), FsspecTarget(url)
    with first.lock() as hold:
        with pytest.raises(InputError, match="is being written by another process"), second.lock():
            pass
        hold()
    with second.lock():
        pass
    assert second.read(".lock") is None


class Box:
    """An object in a store."""

    def __init__(self) -> None:
        self.data: bytes | None = None

    def lease(self, beat: float = 0.05) -> Lease:
        def write(name: str, data: bytes) -> None:
            self.data = data

        def create(name: str, data: bytes) -> bool:
            if self.data is not None:
                return False
            self.data = data
            return True

        def remove(name: str) -> None:
            self.data = None

        return Lease("s3://bucket", lambda name: self.data, create, write, remove, beat)


def test_a_lease_that_stands_still_is_taken_over_whatever_the_clocks_say(monkeypatch: pytest.MonkeyPatch) -> None:
    box = Box()
    foreign = {"token": "x", "beat": 3, "host": "elsewhere/boot", "pid": 1}
    box.data = json.dumps(foreign).encode()
    monkeypatch.setattr(time, "time", lambda: -1e9)  # nobody looks at it
    mine = box.lease()
    begin = time.monotonic()
    mine.acquire()
    assert time.monotonic() - begin >= leases.PATIENCE * 0.05
    mine.hold()
    mine.release()
    assert box.data is None


def test_a_lease_that_moves_is_respected() -> None:
    box, done = Box(), threading.Event()

    def beat() -> None:
        count = 0
        while not done.wait(0.02):
            count += 1
            box.data = json.dumps({"token": "x", "beat": count, "host": "elsewhere/boot", "pid": 1}).encode()

    box.data = b"{}"
    other = threading.Thread(target=beat)
    other.start()
    with pytest.raises(InputError, match="another process"):
        box.lease().acquire()
    done.set()
    other.join()


def test_the_lease_of_a_dead_process_of_this_machine_is_taken_at_once() -> None:
    box = Box()
    dead = json.loads(box.lease()._text()) | {"pid": 2**22 - 1, "token": "x"}
    box.data = json.dumps(dead).encode()
    begin = time.monotonic()
    mine = box.lease(beat=5.0)
    mine.acquire()
    assert time.monotonic() - begin < 2.0
    mine.release()


def test_a_lease_that_was_lost_is_noticed() -> None:
    box = Box()
    mine = box.lease(beat=0.02)
    mine.acquire()
    box.data = json.dumps({"token": "other", "beat": 0}).encode()
    time.sleep(0.3)
    with pytest.raises(InputError, match="was taken over by another driver"):
        mine.hold()
    mine.release()
    assert box.data is not None, "the other's lease stays"


def test_what_lies_at_a_url_is_not_written_over(local: Path, url: str) -> None:
    target = open_target(url)
    target.write("thesis.tex", b"x")
    with pytest.raises(InputError, match=r"holds thesis.tex and is not a sweep"):
        run_sweep(local / "spec/sweep.yaml", target, lambda plan: Here(plan, target))


def test_an_unknown_kind_of_url_is_one_line() -> None:
    with pytest.raises(InputError, match="cannot be opened"):
        open_target("gopher://host/sweep")


def test_an_object_cannot_name_a_path_outside_its_run(
    local: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = FsspecTarget(f"file://{tmp_path}/out")
    monkeypatch.setattr(target, "_list", lambda run: [f"{run}/../../../escaped.txt"])
    with pytest.raises(InputError, match="leaves the folder of its run"):
        target.copy_run("runs/000/000001", tmp_path / "copy")
    assert not (tmp_path / "escaped.txt").exists()


def test_runs_can_go_without_their_scene(url: str, tmp_path: Path) -> None:
    file = write_sweep(tmp_path / "spec", SWEEP.replace("frames: 3", "frames: 1\nwith_scene: false\nstreams: [depth]"))
    target = open_target(url)
    run_sweep(file, target, lambda plan: Here(plan, target))
    out = downloaded(url, tmp_path / "copy")
    assert len(list(out.glob("runs/*/*/depth/*.png"))) == 16
    assert not list(out.glob("runs/*/*/scene.*"))
    assert len(list(out.glob("scenes/*/scene.ply"))) == 2
