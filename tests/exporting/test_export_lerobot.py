"""LeRobot data sets: the layout by pyarrow and pandas, and LeRobot's own loader where it is installed."""

import io
import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import yaml
from moving import CAMERA, write_scene
from PIL import Image
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.exporting import export, export_together
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene

pd = pytest.importorskip("pandas")


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> list[Run]:
    folder = tmp_path_factory.mktemp("lerobot")
    scene = load_scene(write_scene(folder))
    for seed, frames in ((0, 4), (1, 3)):
        generate(scene, "stand", CAMERA, "paper", folder / f"run{seed}", frames=frames, seed=seed)
    rows = "t,wx,wy,wz,ax,ay,az\n" + "".join(f"{t / 100},{t},0,0,0,0,9.81\n" for t in range(60))
    for seed in (0, 1):
        (folder / f"run{seed}" / "imu.csv").write_text(rows)
    return [Run.open(folder / f"run{seed}") for seed in (0, 1)]


@pytest.fixture(scope="module")
def made(runs: list[Run], tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("made") / "set"
    assert export_together(runs, out) == "7 frames in 2 episodes of depth, clean, rgb, instance"
    return out


def opened(cell: dict) -> np.ndarray:
    return np.array(Image.open(io.BytesIO(cell["bytes"])))


def test_pictures_are_there_to_the_bit_and_numbers_beside_them(runs: list[Run], made: Path) -> None:
    for episode, run in enumerate(runs):
        table = pq.read_table(made / "data" / "chunk-000" / f"file-{episode:03d}.parquet").to_pylist()
        assert len(table) == len(run)
        for index, row in enumerate(table):
            assert np.array_equal(opened(row["observation.images.depth"]), run.depth_raw(index))
            assert np.array_equal(opened(row["observation.images.instance"]), run.instance(index))
            rgb = run.rgb(index)
            assert rgb is not None
            assert np.array_equal(opened(row["observation.images.rgb"])[..., 0], rgb)
            assert np.allclose(row["observation.state"][:3], run.poses[index][:3, 3], atol=1e-6)
            assert row["observation.stamp"] == run.stamps[index]
            assert row["observation.imu"][0] == pytest.approx(100 * run.stamps[index], abs=1e-3)
            assert row["observation.environment_state"][1] == pytest.approx(-0.5 + 2 * run.stamps[index], abs=1e-5)
            assert row["timestamp"] == pytest.approx(index / 30)
            assert (row["frame_index"], row["episode_index"], row["task_index"]) == (index, episode, 0)
            assert row["index"] == index + 4 * episode


def test_what_describes_the_data_fits_it(runs: list[Run], made: Path) -> None:
    info = json.loads((made / "meta" / "info.json").read_text())
    assert info["codebase_version"] == "v3.0"
    assert (info["total_episodes"], info["total_frames"], info["fps"]) == (2, 7, 30)
    assert info["features"]["observation.images.depth"]["shape"] == [48, 64, 1]
    assert info["features"]["observation.images.depth"]["info"]["is_depth_map"] is True
    schema = pq.read_schema(made / "data" / "chunk-000" / "file-000.parquet")
    known = json.loads(schema.metadata[b"huggingface"])["info"]["features"]
    assert list(known) == schema.names == list(info["features"])
    episodes = pd.read_parquet(made / "meta" / "episodes" / "chunk-000" / "file-000.parquet")
    assert list(episodes["length"]) == [4, 3]
    assert list(episodes["dataset_from_index"]) == [0, 4]
    assert list(episodes["data/file_index"]) == [0, 1]
    tasks = pd.read_parquet(made / "meta" / "tasks.parquet")
    assert tasks.iloc[0].name == "see parcel" and tasks.index.name == "task"
    stats = json.loads((made / "meta" / "stats.json").read_text())
    assert set(stats) == set(info["features"])
    every = np.concatenate([run.trajectory.positions for run in runs])
    state = stats["observation.state"]
    assert np.allclose(state["mean"][:3], every.mean(axis=0)) and np.allclose(state["std"][:3], every.std(axis=0))
    depth = np.stack([run.depth_raw(i)[::4, ::4] for run in runs for i in range(len(run))]).astype(float)
    found = stats["observation.images.depth"]
    assert np.ravel(found["mean"]) == pytest.approx(depth.mean()) and np.ravel(found["std"]) == pytest.approx(
        depth.std()
    )
    assert found["count"] == [7]


def test_depth_in_other_units_is_floats_of_metres(tmp_path: Path) -> None:
    fine = CAMERA.model_copy(update={"depth_scale": 1e-4, "rate": 29.6})
    generate(load_scene(write_scene(tmp_path)), "stand", fine, "paper", tmp_path / "run", frames=2)
    run = Run.open(tmp_path / "run")
    export(run, "lerobot", tmp_path / "out")
    row = pq.read_table(tmp_path / "out" / "data" / "chunk-000" / "file-000.parquet").to_pylist()[1]
    assert np.array_equal(opened(row["observation.images.depth"]), run.depth(1))
    info = json.loads((tmp_path / "out" / "meta" / "info.json").read_text())
    assert info["features"]["observation.images.depth"]["info"]["depth_unit"] == "m"
    assert info["fps"] == 30 and "observation.imu" not in info["features"]


def test_the_same_runs_give_the_same_bytes(runs: list[Run], made: Path, tmp_path: Path) -> None:
    export_together(runs, tmp_path / "again")
    for file in made.rglob("*"):
        if file.is_file():
            assert file.read_bytes() == (tmp_path / "again" / file.relative_to(made)).read_bytes()


def test_runs_that_differ_are_refused_and_leave_nothing(runs: list[Run], tmp_path: Path) -> None:
    generate(
        load_scene(write_scene(tmp_path)), "stand", CAMERA, "paper", tmp_path / "run", frames=1, streams=("depth",)
    )
    with pytest.raises(InputError, match="export runs of one camera"):
        export_together([runs[0], Run.open(tmp_path / "run")], tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_sweep_writes_its_runs_as_one(tmp_path: Path) -> None:
    write_scene(tmp_path)
    sweep = {"scenes": ["scene.yaml"], "profiles": ["paper"], "seeds": 3, "frames": 2, "camera": CAMERA.model_dump()}
    (tmp_path / "sweep.yaml").write_text(yaml.safe_dump(sweep))
    command = ["sweep", str(tmp_path / "sweep.yaml"), "--out", str(tmp_path / "out"), "--workers", "1"]
    done = CliRunner().invoke(app, [*command, "--lerobot", str(tmp_path / "set")])
    assert done.exit_code == 0, done.output
    assert "6 frames in 3 episodes" in done.output
    assert len(list((tmp_path / "set" / "data" / "chunk-000").iterdir())) == 3
    taken = CliRunner().invoke(app, [*command, "--lerobot", str(tmp_path / "set")])
    assert taken.exit_code != 0


def test_datasets_reads_the_parquet(runs: list[Run], made: Path) -> None:
    datasets = pytest.importorskip("datasets")
    table = datasets.Dataset.from_parquet([str(file) for file in sorted((made / "data").glob("*/*.parquet"))])
    assert len(table) == 7
    assert np.array_equal(np.array(table[5]["observation.images.depth"]), runs[1].depth_raw(1))


def test_lerobot_reads_it_by_its_own_loader(runs: list[Run], made: Path) -> None:
    pytest.importorskip("lerobot")
    from lerobot.datasets.lerobot_dataset import LeRobotDataset

    data = LeRobotDataset("depthsim/parcel", root=made)
    assert (data.num_episodes, data.num_frames, data.fps) == (2, 7, 30)
    item = data[5]
    assert item["task"] == "see parcel"
    assert np.array_equal(np.asarray(item["observation.images.depth"]).squeeze(), runs[1].depth_raw(1))
    assert tuple(item["observation.images.rgb"].shape) == (3, 48, 64)
    assert np.allclose(item["observation.state"][:3], runs[1].poses[1][:3, 3], atol=1e-6)
    assert len(LeRobotDataset("depthsim/parcel", root=made, episodes=[1])) == 3
