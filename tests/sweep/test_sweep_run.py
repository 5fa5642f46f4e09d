"""Sweeps made, broken off and finished: the same bytes whoever makes them, and nothing made twice."""

import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from commands import depthsim_here
from sweeps import SWEEP, Here, tree, write_sweep

from depthsim.errors import InputError
from depthsim.runs import Run
from depthsim.runs.png import END
from depthsim.scenefile import load_scene
from depthsim.sweep.drive import Progress, run_sweep
from depthsim.sweep.events import Event, Job, lost
from depthsim.sweep.manifest import Manifest
from depthsim.sweep.plan import Plan
from depthsim.sweep.pool import Pool
from depthsim.sweep.target import LocalTarget, open_target

FIRST = "depth/0.000000.png"


@pytest.fixture
def sweep(tmp_path: Path) -> Path:
    return write_sweep(tmp_path / "spec")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sweep as one worker process makes it; to be read, not to be changed."""
    folder = tmp_path_factory.mktemp("made")
    assert in_pool(write_sweep(folder / "spec"), folder / "out", 1).runs_made == 16
    return folder / "out"


def in_pool(file: Path, out: Path | str, workers: int, **keys: bool) -> Progress:
    target = open_target(str(out))
    return run_sweep(file, target, lambda plan: Pool(target.url, workers), **keys)


def here(file: Path, out: Path | str, **keys: object) -> tuple[Progress, list[int]]:
    """The same by a worker in this process, and the runs that it was given."""
    target, makers = open_target(str(out)), []

    def start(plan: Plan) -> Here:
        makers.append(Here(plan, target, **keys))  # type: ignore[arg-type]
        return makers[0]

    progress = run_sweep(file, target, start)
    return progress, makers[0].made if makers else []


def copied(made: Path, out: Path) -> Path:
    shutil.copytree(made, out)
    return out


def test_four_workers_give_the_bytes_of_one(sweep: Path, made: Path, tmp_path: Path) -> None:
    done = in_pool(sweep, tmp_path / "out", 4)
    assert (done.whole, done.runs_made, done.frames_made, done.failed, done.lost) == (16, 16, 48, 0, 0)
    assert tree(tmp_path / "out") == tree(made)


def test_ray_gives_the_bytes_of_one_worker(sweep: Path, made: Path, tmp_path: Path) -> None:
    if importlib.util.find_spec("ray") is None:
        pytest.skip("the ray wheel is not installed: pip install '.[ray]'")
    result = depthsim("sweep", sweep, "--out", tmp_path / "out", "--ray", "local", "--workers", 2)
    if "timed out during startup" in result.stderr:
        pytest.skip("Ray's own processes did not start in its 30 s, three times: this machine is too busy")
    assert result.returncode == 0, result.stderr
    assert "16 of 16 runs are whole, 16 made now (48 frames" in result.stdout
    assert tree(tmp_path / "out") == tree(made)


def test_a_cluster_that_is_not_there_is_one_line(sweep: Path, tmp_path: Path) -> None:
    if importlib.util.find_spec("ray") is None:
        pytest.skip("the ray wheel is not installed: pip install '.[ray]'")
    result = depthsim("sweep", sweep, "--out", tmp_path / "out", "--ray", "127.0.0.1:1")
    assert result.returncode == 2
    assert result.stderr.startswith("--ray 127.0.0.1:1: no cluster (")
    assert len(result.stderr.splitlines()) == 1


def test_each_scene_is_built_once_a_worker(made: Path) -> None:
    from pyarrow import parquet

    rows = parquet.read_table(made / "work.parquet").to_pylist()
    assert max(row["built"] for row in rows) == 2, "two scenes, with and without swapped materials"
    assert {row["attempts"] for row in rows} == {1}


def test_a_run_of_a_sweep_is_a_run(made: Path) -> None:
    from pyarrow import parquet

    rows = parquet.read_table(made / "manifest.parquet").to_pylist()
    swapped = next(row for row in rows if json.loads(row["values"])["materials.plastic"] == "formboard")
    run = Run.open(made / swapped["path"])
    assert len(run) == swapped["frames"] == 3
    assert run.meta["seed"] == swapped["noise_seed"]
    assert set(run.tags) == {"cement", "formboard"}
    assert run.scene is not None
    scene = load_scene(run.scene)
    assert scene.tags == run.tags
    assert scene.digest == run.meta["scene_digest"]
    assert run.meta["materials"]["cement"]["m"] == json.loads(swapped["values"])["surfaces.cement.m"]
    assert os.stat(run.scene.with_name("scene.ply")).st_nlink == 9, "one mesh for the eight runs of a scene"


def test_a_second_call_makes_nothing(sweep: Path, made: Path, tmp_path: Path) -> None:
    out = copied(made, tmp_path / "out")
    progress, given = here(sweep, out)
    assert (progress.whole, progress.runs_made, given) == (16, 0, [])
    assert tree(out, without=()) == tree(made, without=()), "not even who made it changes"


def test_a_second_call_finishes_what_is_missing(sweep: Path, made: Path, tmp_path: Path) -> None:
    out = copied(made, tmp_path / "out")
    shutil.rmtree(out / "runs/000/000003")
    (out / "runs/000/000009/depth.txt").unlink()
    (out / "runs/000/000009" / FIRST).unlink()
    progress, given = here(sweep, out)
    assert given == [3, 9]
    assert progress.frames_made == 4, "three of the one, and one of the other"
    assert tree(out) == tree(made)


def test_a_lost_manifest_is_made_again_from_the_runs(sweep: Path, made: Path, tmp_path: Path) -> None:
    out = copied(made, tmp_path / "out")
    (out / "manifest.parquet").unlink()
    (out / "work.parquet").unlink()
    progress, _ = here(sweep, out)
    assert (progress.whole, progress.frames_made) == (16, 0)
    assert tree(out) == tree(made)
    (out / "manifest.parquet").write_bytes(b"PAR1 and then nothing")
    with pytest.raises(InputError, match="is damaged"):
        here(sweep, out)


READS_ON_ONE_THREAD = """
import sys
from pathlib import Path
import pyarrow.parquet
from depthsim.sweep.show import State
names = lambda: [file.read_text() for file in Path("/proc/self/task").glob("*/comm")]
threads = lambda: sum("jemalloc" not in name for name in names())  # those of the allocator hold nothing of ours
before = threads()
State.read(sys.argv[1])
print(threads() - before)
"""


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted in /proc, which is Linux")
def test_the_manifest_is_read_without_threads(made: Path) -> None:
    """A thread that holds the file as the interpreter ends aborts the process: 10 bare scripts of 40, one CI run."""
    command = [sys.executable, "-c", READS_ON_ONE_THREAD, str(made)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout, result.stderr) == (0, "0\n", "")


def test_damage_is_found_and_mended(sweep: Path, made: Path, tmp_path: Path) -> None:
    out = copied(made, tmp_path / "out")
    flipped = out / "runs/000/000002" / FIRST
    data = bytearray(flipped.read_bytes())
    data[len(data) // 2] ^= 1
    flipped.write_bytes(data)  # begins and ends as a PNG does
    assert data.endswith(END)
    other = out / "runs/000/000005/rgb/0.000000.png"
    other.write_bytes((out / "runs/000/000006/rgb/0.000000.png").read_bytes())  # sound, but of another run
    camera = out / "runs/000/000008/camera.yaml"
    camera.write_text(camera.read_text().replace("53.0", "54.0"))
    (out / "runs/000/000010/run.yaml").write_text("junk")
    assert here(sweep, out)[1] == [], "it costs reading all, so it is done when it is asked for"
    progress = in_pool(sweep, out, 2, check=True)
    assert (progress.whole, progress.repaired, progress.failed) == (16, 4, 0)
    assert progress.frames_made == 1 + 3 * 3, "of the first run the one frame"
    assert tree(out) == tree(made)


def test_a_worker_that_dies_is_replaced_and_costs_its_frame(sweep: Path, made: Path, tmp_path: Path) -> None:
    target, pools = open_target(tmp_path / "out"), []

    def start(plan: Plan) -> Pool:
        pools.append(Pool(target.url, 2))
        return pools[0]

    killed: list[int] = []

    def show(progress: Progress) -> None:
        if progress.frames_made > 8 * (len(killed) + 1) and len(killed) < 3:
            killed.append(pools[0].pids[0])
            os.kill(killed[-1], signal.SIGKILL)

    progress = run_sweep(sweep, target, start, show=show)
    assert (progress.whole, progress.failed) == (16, 0)
    assert len(killed) == 3
    assert pools[0].lost == 3
    assert progress.frames_made <= 48 + 3, "no more than the frames in flight were made again"
    assert tree(tmp_path / "out") == tree(made)


def test_a_killed_driver_is_gone_on_with(sweep: Path, made: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    command = [sys.executable, "-m", "depthsim", "sweep", str(sweep), "--out", str(out), "--workers", "2"]
    driver = subprocess.Popen(command)
    until = time.monotonic() + 120
    while len(list(out.glob("runs/*/*/depth.txt"))) < 4 and time.monotonic() < until:
        time.sleep(0.01)
    driver.kill()
    driver.wait()
    progress = in_pool(sweep, out, 2)
    assert progress.whole == 16
    assert progress.frames_made < 48 - 9, "the whole runs were not made twice"
    assert tree(out) == tree(made)


def test_a_run_that_fails_three_times_is_reported_and_the_others_are_made(sweep: Path, tmp_path: Path) -> None:
    tries = []

    def spoil(job: Job) -> Event | None:
        if job.run != 5:
            return None
        tries.append(job.run)
        return lost(5, "SIGSEGV")

    progress, _ = here(sweep, tmp_path / "out", spoil=spoil)
    assert (progress.whole, progress.failed, progress.lost, len(tries)) == (15, 1, 3, 3)
    assert "SIGSEGV" in progress.first_error
    shown = depthsim_here("inspect", tmp_path / "out")
    assert "15 whole (93.8%), 1 failed, 0 missing" in shown.stdout
    assert "failed, 1 runs, the first runs/000/000005: run 5: its worker died (SIGSEGV)" in shown.stdout
    progress, given = here(sweep, tmp_path / "out")
    assert given == [5], "the next call tries it anew"
    assert (progress.whole, progress.failed) == (16, 0)


def test_a_full_disk_ends_the_sweep_at_once(sweep: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write = Path.write_bytes

    def refuse(path: Path, data: bytes) -> int:
        if "000004" in str(path):
            raise OSError(28, "No space left on device")
        return write(path, data)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_bytes", refuse)
        with pytest.raises(InputError, match="free some space and give the same command again") as caught:
            here(sweep, tmp_path / "out")
        assert "no space left on device" in str(caught.value)
    progress, given = here(sweep, tmp_path / "out")
    assert given == list(range(4, 16)), "what was whole is not made twice"
    assert progress.whole == 16


def test_a_target_that_is_something_else_is_refused(sweep: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.tex").write_text("x")
    with pytest.raises(InputError, match=r"holds thesis.tex and is not a sweep"):
        here(sweep, tmp_path / "out")
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["thesis.tex"]


def test_a_bad_sweep_leaves_nothing_behind(sweep: Path, tmp_path: Path) -> None:
    sweep.write_text(SWEEP.replace("radius=0.5", "radius=-1"))
    result = depthsim_here("sweep", sweep, "--out", tmp_path / "out")
    assert result.returncode == 2
    assert len(result.stderr.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_scene_that_changed_is_refused(sweep: Path, made: Path, tmp_path: Path) -> None:
    out = copied(made, tmp_path / "out")
    hall = sweep.with_name("hall.obj")
    hall.write_text(hall.read_text().replace("3.5", "3.6"))
    with pytest.raises(InputError, match=r"scene hall\.obj: hall\.obj has changed since the sweep was begun"):
        here(sweep, out)
    hall.write_text(hall.read_text().replace("3.6", "3.5"))
    sweep.write_text(SWEEP.replace("profiles: [paper", "profiles: [mine.yaml"))
    sweep.with_name("mine.yaml").write_text("effects: []\n")
    with pytest.raises(InputError, match="profiles is"):
        here(sweep, out)


def test_a_second_driver_is_refused(sweep: Path, made: Path, tmp_path: Path) -> None:
    out = copied(made, tmp_path / "out")
    with LocalTarget(out).lock():
        result = depthsim("sweep", sweep, "--out", out)
    assert result.returncode == 2
    assert result.stderr.strip().endswith("is being written by another process; wait for it, or end it")


def test_half_a_line_of_the_journal_is_cut_off(made: Path, tmp_path: Path) -> None:
    out = copied(made, tmp_path / "out")
    target = LocalTarget(out)
    plan = Plan.from_json((out / "plan.json").read_text(), out)
    manifest = Manifest(target, plan)
    row = manifest.rows[3]
    reported = json.dumps({**row, "bytes": 1}).encode()
    (out / "journal.jsonl").write_bytes(b"[" * 100_000 + b"\n" + reported + b'\n{"run": 4, "sta')
    again = Manifest(LocalTarget(out), plan)
    assert again.rows[3]["bytes"] == 1
    assert again.rows[4] == manifest.rows[4]
    again.put({**row, "bytes": 2})
    again.flush()
    lines = (out / "journal.jsonl").read_bytes().splitlines()[1:]
    assert [json.loads(line)["bytes"] for line in lines] == [1, 2]


def test_dry_run_counts_measures_and_makes_nothing(sweep: Path, tmp_path: Path) -> None:
    before = tree(tmp_path)
    result = depthsim_here("sweep", sweep, "--dry-run", "--workers", "2")
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith("small: 16 runs, 48 frames\n")
    assert "with 2 workers" in result.stdout
    assert tree(tmp_path) == before


def test_inspect_shows_a_run_at_random(made: Path, tmp_path: Path) -> None:
    result = depthsim_here("inspect", made, "--draw", "12", "--preview", tmp_path / "run.png")
    assert result.returncode == 0, result.stderr
    assert "16 whole (100.0%), 0 failed, 0 missing; 48 frames" in result.stdout
    assert "hall.obj, d435: " in result.stdout
    assert "runs/000/000012: hall.obj" in result.stdout
    assert (tmp_path / "run.png").stat().st_size > 10_000
    assert depthsim_here("inspect", made, "--draw", "16").returncode == 2


def depthsim(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "depthsim", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)
