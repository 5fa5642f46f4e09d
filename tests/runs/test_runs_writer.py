import errno
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import yaml

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.runs import Run, RunWriter
from depthsim.runs.storing import FolderLock, write_whole
from depthsim.trajectory import Trajectory

CAMERA = Camera(name="small", width=40, height=30, fx=30, fy=30, cx=19.5, cy=14.5, baseline=0.05)
COUNT = 9
STREAMS = ("depth", "clean", "material", "normal", "rgb")
RECORD = {
    "scene": "tunnel",
    "tags": ["cement", "plastic"],
    "sensor": {"camera": "d435", "effects": [{"id": "material_noise"}, {"id": "fill_rate", "rate": 0.01}]},
    "seed": 7,
    "version": "0.1.0",
}


def trajectory(shift: float = 0.0) -> Trajectory:
    stamps = np.arange(COUNT) / 30
    positions = np.stack([stamps, stamps * 0, stamps * 0 + 1 + shift], axis=1)
    return Trajectory(stamps, positions, np.tile([0.0, 0.0, 0.0, 1.0], (COUNT, 1)))


def frame(index: int) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(index)
    normals = rng.standard_normal((30, 40, 3)).astype(np.float32)
    return {
        "depth": rng.integers(0, 65536, CAMERA.shape, dtype=np.uint16),
        "clean": rng.integers(900, 1000, CAMERA.shape, dtype=np.uint16),
        "material": rng.integers(0, 2, CAMERA.shape, dtype=np.uint8),
        "normal": normals / np.linalg.norm(normals, axis=2, keepdims=True),
        "rgb": rng.integers(0, 256, CAMERA.shape, dtype=np.uint8),
    }


def open_writer(path: Path, **changes) -> RunWriter:
    arguments = {"camera": CAMERA, "trajectory": trajectory(), "record": RECORD, "streams": STREAMS} | changes
    return RunWriter(path, **arguments)


def write_all(writer: RunWriter) -> None:
    with writer:
        for index in writer.missing():
            writer.write_frame(index, {stream: frame(index)[stream] for stream in writer.streams})
        writer.finish()


def tree(path: Path) -> dict[str, bytes]:
    return {str(p.relative_to(path)): p.read_bytes() if p.is_file() else b"" for p in path.rglob("*")}


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory) -> dict[str, bytes]:
    path = tmp_path_factory.mktemp("runs") / "deep" / "run"
    write_all(open_writer(path))
    return tree(path)


def test_the_layout(unbroken):
    names = [f"{index / 30:.6f}.png" for index in range(COUNT)]
    files = {f"{stream}/{name}" for stream in STREAMS for name in names}
    lists = {"camera.yaml", "run.yaml", "groundtruth.txt", "depth.txt", "clean.txt", "rgb.txt"}
    assert set(unbroken) == files | lists | set(STREAMS)
    assert unbroken["depth.txt"].startswith(b"# timestamp filename\n0.000000 depth/0.000000.png\n0.033333 depth/0.0333")
    assert yaml.safe_load(unbroken["run.yaml"]) == {
        "frames": COUNT,
        "streams": ["clean", "material", "normal", "rgb", "depth"],
        **RECORD,
    }
    truth = np.loadtxt(unbroken["groundtruth.txt"].decode().splitlines())
    np.testing.assert_array_equal(truth[:, 0], np.round(np.arange(COUNT) / 30, 6))


def test_evo_reads_the_ground_truth(unbroken, tmp_path):
    evo = pytest.importorskip("evo.tools.file_interface", reason="evo is not installed")
    (tmp_path / "groundtruth.txt").write_bytes(unbroken["groundtruth.txt"])
    theirs = evo.read_tum_trajectory_file(str(tmp_path / "groundtruth.txt"))
    np.testing.assert_array_equal(theirs.positions_xyz, trajectory().positions)


def test_only_depth(tmp_path):
    write_all(open_writer(tmp_path / "run", streams=("depth",)))
    assert {path.name for path in (tmp_path / "run").iterdir()} == {
        "camera.yaml",
        "run.yaml",
        "groundtruth.txt",
        "depth.txt",
        "depth",
    }


def test_threads_write_the_same_bytes(unbroken, tmp_path):
    with open_writer(tmp_path / "run") as writer, ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda index: writer.write_frame(index, frame(index)), writer.missing()[::-1]))
        writer.finish()
    assert tree(tmp_path / "run") == unbroken


@pytest.mark.parametrize("made", [0, 1, 5, COUNT])
def test_a_broken_off_run_ends_in_the_same_bytes(unbroken, tmp_path, made):
    run = tmp_path / "run"
    writer = open_writer(run)
    for index in range(made):
        writer.write_frame(index, frame(index))
    writer._lock._file.close()  # the system does this to a killed process; the lock's file stays
    for name in (".run.yaml.tmp", "depth/.0.033333.png.tmp", "rgb/.0.200000.png.tmp"):
        (run / name).write_bytes(b"\x89PNG\r\n\x1a\nhalf")
    (run / "camera.yaml").unlink()
    broken = set(range(made, COUNT))
    if made == 5:
        cut = run / "depth" / "0.000000.png"
        cut.write_bytes(cut.read_bytes()[:-5])
        (run / "clean" / "0.033333.png").write_bytes(b"")
        (run / "normal" / "0.066667.png").unlink()
        (run / "rgb" / "0.200000.png").write_bytes(frame(6)["rgb"].tobytes())
        broken |= {0, 1, 2}
    with pytest.raises(InputError, match=f"unfinished: {made} of {COUNT} frames; the same generate command"):
        Run.open(run)
    resumed = open_writer(run)
    assert resumed.missing() == sorted(broken)
    write_all(resumed)
    assert tree(run) == unbroken
    assert len(Run.open(run)) == COUNT


def test_broken_off_before_the_record_is_there(unbroken, tmp_path):
    (tmp_path / ".lock").touch()
    (tmp_path / ".run.yaml.tmp").write_text("fra")
    write_all(open_writer(tmp_path))
    assert tree(tmp_path) == unbroken


def test_a_finished_run_has_nothing_missing(unbroken, tmp_path):
    write_all(open_writer(tmp_path))
    again = open_writer(tmp_path)
    assert again.missing() == []
    again.finish()
    assert tree(tmp_path) == unbroken


def test_a_frame_lost_from_a_finished_run_makes_it_unfinished(unbroken, tmp_path):
    write_all(open_writer(tmp_path))
    (tmp_path / "depth" / "0.100000.png").write_bytes(b"")
    with open_writer(tmp_path) as writer:
        assert writer.missing() == [3]
        assert not (tmp_path / "depth.txt").exists()
        with pytest.raises(RuntimeError, match="1 frames are missing, the first is 3"):
            writer.finish()
    write_all(open_writer(tmp_path))
    assert tree(tmp_path) == unbroken


CHANGES = [
    ({"record": RECORD | {"seed": 8}}, "run.yaml: seed: is 7 in this folder, but 8 is asked for"),
    ({"record": RECORD | {"seed": 7.0}}, "run.yaml: seed: is 7 in this folder, but 7.0"),
    ({"record": RECORD | {"tags": ["cement", "wood"]}}, "run.yaml: tags.1: is 'plastic' in this folder, but 'wood'"),
    ({"record": RECORD | {"tags": ["cement"]}}, "run.yaml: tags: is "),
    ({"record": RECORD | {"note": "x"}}, "run.yaml: note: is not there in this folder, but 'x'"),
    (
        {"record": {key: value for key, value in RECORD.items() if key != "version"}},
        "run.yaml: version: is '0.1.0' in this folder, but not there",
    ),
    (
        {"record": RECORD | {"sensor": {"camera": "d435", "effects": [{"id": "material_noise"}, {"id": "fill_rate"}]}}},
        "run.yaml: sensor.effects.1.rate: is 0.01 in this folder, but not there",
    ),
    ({"streams": ("depth",)}, "run.yaml: streams: is "),
    ({"camera": CAMERA.model_copy(update={"fx": 31.0})}, "camera.yaml: fx: is 30.0 in this folder, but 31.0"),
    ({"trajectory": trajectory(0.5)}, "groundtruth.txt: line 2: the poses in this folder are not those asked for"),
]


@pytest.mark.parametrize(("change", "problem"), CHANGES)
def test_another_run_is_not_written_over(tmp_path, change, problem):
    write_all(open_writer(tmp_path))
    before = tree(tmp_path)
    with pytest.raises(InputError) as error:
        open_writer(tmp_path, **change)
    assert f"{tmp_path}/{problem}" in str(error.value)
    assert str(error.value).endswith("give another `path`, or `overwrite`")
    assert tree(tmp_path) == before


def test_overwrite_removes_a_run_and_nothing_else(unbroken, tmp_path):
    write_all(open_writer(tmp_path, record=RECORD | {"seed": 8}))
    (tmp_path / "depth" / ".0.900000.png.tmp").touch()
    (tmp_path / "depth" / "0.900000.png").touch()
    (tmp_path / "preview.png").touch()
    notes = {"notes.md": b"mine", "depth/look.png": b"mine too", "mask": b"", "mask/0.000000.png": b"drawn"}
    (tmp_path / "mask").mkdir()
    for name, data in notes.items():
        if data:
            (tmp_path / name).write_bytes(data)
    write_all(open_writer(tmp_path, overwrite=True))
    assert tree(tmp_path) == unbroken | notes
    write_all(open_writer(tmp_path, streams=("depth",), overwrite=True))
    assert not (tmp_path / "clean").exists() and not (tmp_path / "rgb.txt").exists()


def test_overwrite_broken_off_can_be_given_again(unbroken, tmp_path, monkeypatch):
    write_all(open_writer(tmp_path, record=RECORD | {"seed": 8}))
    (tmp_path / "notes.md").write_text("mine")

    def killed(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr("depthsim.runs.writer.write_whole", killed)
        open_writer(tmp_path, overwrite=True)
    with pytest.raises(InputError, match=r"unfinished: 0 of 9"):
        Run.open(tmp_path)
    write_all(open_writer(tmp_path, overwrite=True))
    assert tree(tmp_path) == unbroken | {"notes.md": b"mine"}


def test_overwrite_does_not_follow_links(tmp_path):
    run, precious = tmp_path / "run", tmp_path / "precious"
    write_all(open_writer(run))
    (run / "rgb").rename(precious)
    (run / "rgb").symlink_to(precious)
    with pytest.raises(InputError, match="rgb: is a link"):
        open_writer(run, overwrite=True)
    assert len(list(precious.iterdir())) == COUNT


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize(
    ("name", "text", "problem"),
    [
        ("thesis.tex", "years of work", "holds thesis.tex and is not a run that depthsim made"),
        ("depth.txt", "0.0 depth/0.png", "holds depth.txt and is not a run"),
        ("run.yaml", "speed: 3", "holds run.yaml and is not a run"),
        ("run.yaml", "- 1", "run.yaml: holds a list"),
    ],
)
def test_a_folder_that_is_no_run_is_left_alone(tmp_path, overwrite, name, text, problem):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=problem):
        open_writer(tmp_path, overwrite=overwrite)
    assert tree(tmp_path) == {name: text.encode()}


def test_targets_that_cannot_be(tmp_path):
    (tmp_path / "file").touch()
    for path, problem in [
        (tmp_path / "file", "is a file, not a folder"),
        (tmp_path / "file" / "run", "not a directory"),
        (Path("/proc/nowhere"), "cannot be written"),
    ]:
        with pytest.raises(InputError, match=problem):
            open_writer(path)


def test_a_second_writer_has_to_wait(unbroken, tmp_path):
    with open_writer(tmp_path) as first:
        for overwrite in (False, True):
            with pytest.raises(InputError, match=f"{re.escape(str(tmp_path))}: is being written by another process"):
                open_writer(tmp_path, overwrite=overwrite)
        first.write_frame(0, frame(0))
    write_all(open_writer(tmp_path))
    assert tree(tmp_path) == unbroken


def test_the_lock_of_a_killed_process_is_free(tmp_path):
    code = "import sys; from pathlib import Path; from depthsim.runs.storing import FolderLock\n"
    code += "lock = FolderLock(Path(sys.argv[1])); print('held', flush=True); sys.stdin.read()"
    other = subprocess.Popen(
        [sys.executable, "-c", code, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    with other:
        assert other.stdout is not None and other.stdout.readline() == "held\n"
        with pytest.raises(InputError, match="is being written"):
            FolderLock(tmp_path)
        other.kill()
        other.wait()
    assert (tmp_path / ".lock").exists()
    FolderLock(tmp_path).release()
    assert not (tmp_path / ".lock").exists()


def test_a_lock_on_a_removed_file_is_no_lock(tmp_path, monkeypatch):
    import fcntl

    real, tries = fcntl.flock, []

    def flock(file, operation):
        real(file, operation)
        tries.append(operation)
        if len(tries) == 1:
            (tmp_path / ".lock").unlink()  # the earlier owner, just now

    monkeypatch.setattr(fcntl, "flock", flock)
    lock = FolderLock(tmp_path)
    assert len(tries) == 2
    with pytest.raises(InputError):
        FolderLock(tmp_path)
    lock.release()


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EACCES, errno.EROFS])
@pytest.mark.parametrize("step", ["write", "replace"])
def test_a_failing_disk_is_one_line(unbroken, tmp_path, monkeypatch, code, step):
    writer = open_writer(tmp_path)
    for index in range(3):
        writer.write_frame(index, frame(index))
    before = tree(tmp_path)

    def fail(path, data):
        if step == "write":
            with path.open("wb") as file:
                file.write(b"half")
        raise OSError(code, os.strerror(code))

    with monkeypatch.context() as patch, pytest.raises(InputError) as error:
        patch.setattr(Path, "write_bytes" if step == "write" else "replace", fail)
        writer.write_frame(3, frame(3))
    assert os.strerror(code).lower() in str(error.value)
    assert "\n" not in str(error.value)
    assert tree(tmp_path) == before
    assert writer.missing() == list(range(3, COUNT))
    writer.close()
    write_all(open_writer(tmp_path))
    assert tree(tmp_path) == unbroken


def test_an_interrupt_leaves_no_half_file(tmp_path, monkeypatch):
    monkeypatch.setattr(Path, "replace", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path / "a.png", b"data")
    assert tree(tmp_path) == {}


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 64 kB, where this user may mount one."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=64k", "none", str(disk)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("a small file system cannot be mounted here")
    yield disk
    subprocess.run(["umount", "-l", str(disk)], check=True)


def test_a_full_disk(small_disk):
    with open_writer(small_disk / "run") as writer, pytest.raises(InputError, match=r"no space left.*free some space"):
        for index in range(COUNT):
            writer.write_frame(index, frame(index))
    left = tree(small_disk / "run")
    assert not any(Path(name).name.startswith(".") for name in left)
    with pytest.raises(InputError, match=r"unfinished: [1-8] of 9"):
        Run.open(small_disk / "run")
    subprocess.run(["mount", "-o", "remount,size=4m", str(small_disk)], check=True)
    write_all(open_writer(small_disk / "run"))
    assert len(Run.open(small_disk / "run")) == COUNT


def test_a_disk_full_from_the_start_and_a_read_only_one(small_disk):
    (small_disk / "rest").mkdir()
    with pytest.raises(OSError, match="space"):
        (small_disk / "rest" / "big").write_bytes(bytes(100_000))
    with pytest.raises(InputError, match="no space left"):
        open_writer(small_disk / "run")
    subprocess.run(["mount", "-o", "remount,ro", str(small_disk)], check=True)
    for path in (small_disk / "run", small_disk / "new"):
        with pytest.raises(InputError, match="read-only file system"):
            open_writer(path)


def test_stamps_are_microseconds(tmp_path):
    stamps = np.array([-1e-9, 1 / 3, 1_700_000_000.1234567])
    path = Trajectory(stamps, np.zeros((3, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (3, 1)))
    with RunWriter(tmp_path / "run", CAMERA, path, {}) as writer:
        for index in range(3):
            writer.write_frame(index, {"depth": frame(index)["depth"]})
        writer.finish()
    run = Run.open(tmp_path / "run")
    assert [file.name for file in run.files] == ["0.000000.png", "0.333333.png", "1700000000.123457.png"]
    np.testing.assert_allclose(run.stamps, stamps, atol=1e-6, rtol=0)
    with pytest.raises(InputError, match="stamp is not after the one before"):
        RunWriter(tmp_path / "close", CAMERA, Trajectory([0, 1e-7], path.positions[:2], path.quaternions[:2]), {})
    assert not (tmp_path / "close").exists()


def test_a_frame_that_does_not_fit_is_refused(tmp_path):
    with open_writer(tmp_path) as writer:
        good = frame(0)
        for stream, picture in [
            ("depth", good["depth"].astype(np.float32)),
            ("depth", good["depth"][:10]),
            ("clean", good["rgb"]),
            ("material", np.dstack([good["rgb"]] * 3)),
            ("rgb", good["depth"]),
        ]:
            with pytest.raises(ValueError, match=stream):
                writer.write_frame(0, good | {stream: picture})
        with pytest.raises(ValueError, match="a frame of this run"):
            writer.write_frame(0, {"depth": good["depth"]})
        assert writer.missing() == list(range(COUNT))
    for streams in [("clean",), ("depth", "mask")]:
        with pytest.raises(ValueError, match="streams are depth"):
            open_writer(tmp_path, streams=streams)
