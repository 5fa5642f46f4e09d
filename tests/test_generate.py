"""`generate` end to end: the same bytes whatever happens on the way."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from commands import depthsim_here
from rooms import ROOM

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.materials import Material, Materials
from depthsim.open3d_loader import load_open3d
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory
from qa.trees import tree

SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"
MATERIALS = Materials({tag: Material(m=m) for tag, m in (("cement", 0.35), ("plastic", 0.85))})
CAMERA = Camera(name="small", width=106, height=60, fx=53, fy=53, cx=52.5, cy=29.5, baseline=0.05, rate=30)

TIMED = """
effects: [time_offset: {offset: 0.02}, rolling_shutter: {readout: 0.02}, material_noise, motion_noise, thermal_drift]
"""


@pytest.fixture
def room(tmp_path: Path) -> Path:
    path = tmp_path / "room.obj"
    path.write_text(ROOM)
    return path


def make(room: Path, out: Path, threads: int = 2, profile: str = "paper", frames: int = 12, seed: int = 7) -> Path:
    scene = load_scene(room, materials=MATERIALS)
    path = load_trajectory("circle:center=0/0/1.2,radius=0.5,speed=1,heading=outward", scene, 30, frames)
    generate(scene, path, CAMERA, load_profile(profile), out, materials=MATERIALS, seed=seed, threads=threads)
    return out


def test_an_effect_on_what_is_no_material_leaves_no_folder(room: Path, tmp_path: Path) -> None:
    """So that the same call, mended, is not taken for another run."""
    profile = tmp_path / "profile.yaml"
    profile.write_text("effects: [material_noise: {m: {cemnt: 0.3}}]")
    with pytest.raises(InputError, match="material_noise: there is no material 'cemnt'"):
        make(room, tmp_path / "run", profile=str(profile))
    assert not (tmp_path / "run").exists()


def test_a_run_has_all_its_parts(room: Path, tmp_path: Path) -> None:
    run = Run.open(make(room, tmp_path / "run"))
    assert len(run) == 12
    assert run.camera == CAMERA
    for stream in ("depth", "clean", "material", "rgb"):
        assert run.has(stream), stream
    clean, depth = run.clean(3), run.depth(3)
    assert clean is not None
    assert (clean > 0).all(), "a closed room has no holes"
    assert 0 < (depth == 0).mean() < 0.05
    assert np.abs(depth - clean)[depth > 0].std() < 0.1
    again = load_scene(run.scene or "", materials=MATERIALS)
    assert again.tags == ("cement", "plastic")
    assert len(again.faces) == 12


def test_same_bytes_for_any_number_of_threads(room: Path, tmp_path: Path) -> None:
    runs = [tree(make(room, tmp_path / f"run{threads}", threads)) for threads in (1, 2, 4)]
    assert runs[0] == runs[1] == runs[2]
    other = tree(make(room, tmp_path / "other", seed=8))
    assert other["depth/0.100000.png"] != runs[0]["depth/0.100000.png"]
    assert other["clean/0.100000.png"] == runs[0]["clean/0.100000.png"]


def test_clean_profile_writes_what_the_rays_met(room: Path, tmp_path: Path) -> None:
    run = Run.open(make(room, tmp_path / "run", profile="clean"))
    for index in range(len(run)):
        np.testing.assert_array_equal(run.depth(index), run.clean(index))


def test_like_takes_poses_stamps_and_camera(room: Path, tmp_path: Path) -> None:
    first = make(room, tmp_path / "first")
    result = depthsim_here("generate", "--like", first, "--out", tmp_path / "second", "--seed", 7, "--only-depth")
    assert result.returncode == 0, result.stderr
    a, b = Run.open(first), Run.open(tmp_path / "second")
    np.testing.assert_array_equal(a.stamps, b.stamps)
    np.testing.assert_array_equal(a.poses, b.poses)
    assert a.camera == b.camera
    assert not b.has("rgb")
    for index in range(len(a)):
        np.testing.assert_array_equal(a.depth_raw(index), b.depth_raw(index))


def test_like_gives_the_same_bytes_where_effects_follow_time(room: Path, tmp_path: Path) -> None:
    """Files name microseconds: what a run is made at must be what is read from it."""
    profile = tmp_path / "timed.yaml"
    profile.write_text(TIMED)
    scene, fine = load_scene(room, materials=MATERIALS), CAMERA.model_copy(update={"depth_scale": 1e-4})
    path = load_trajectory("circle:center=0/0/1.2,radius=0.5,speed=1,heading=outward", scene, 30, 12)
    first = tmp_path / "first"
    generate(scene, path, fine, load_profile(profile), first, materials=MATERIALS, seed=7)
    again = generate(
        scene, Run.open(first).trajectory, fine, load_profile(profile), tmp_path / "second", materials=MATERIALS, seed=7
    )
    assert tree(again.path) == tree(first)


def test_like_a_real_recording(tmp_path: Path) -> None:
    recording = SHARED / "d435_floor"
    if not recording.is_dir():
        pytest.skip(f"the real frames are not there ({recording.name} in ../shared/data)")
    result = depthsim_here("generate", "--like", str(recording), "--out", str(tmp_path / "sim"), "--frames", "12")
    assert result.returncode == 0, result.stderr
    real, sim = Run.open(recording), Run.open(tmp_path / "sim")
    np.testing.assert_array_equal(real.stamps[:12], sim.stamps)
    for index in (0, 11):
        mask, measured, clean = real.mask(index), real.depth(index), sim.clean(index)
        assert mask is not None and clean is not None
        good = mask & (measured > 0) & (clean > 0)
        # The floor was fitted to these frames, so the clean cast must lie on them.
        assert np.median(np.abs(measured - clean)[good] / clean[good]) < 0.01


def test_killed_at_random_moments_and_resumed(room: Path, tmp_path: Path) -> None:
    path = "circle:center=0/0/1.2,radius=0.5,speed=1,heading=outward"
    command = [sys.executable, "-m", "depthsim", "generate", str(room), "--trajectory", path, "--frames", "90"]
    command += ["--resolution", "424x240", "--camera", "d435"]
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    subprocess.run([*command, "--out", str(whole)], check=True, capture_output=True)
    expected = tree(whole)
    generator, killed, resumed = random.Random(4), 0, 0
    for turn in range(40):
        if turn >= 12 and killed >= 7 and resumed >= 3:
            break  # a busy machine makes many frames between two looks at them, and needs more turns
        process = subprocess.Popen([*command, "--out", str(broken)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        # Wait for a random number of further frames, then a random moment, which falls anywhere inside a frame.
        already = len(list((broken / "depth").glob("*.png")))
        wanted = already + generator.randrange(0, 40)
        while process.poll() is None and len(list((broken / "depth").glob("[0-9]*.png"))) < min(wanted, 89):
            time.sleep(0.001)
        time.sleep(generator.uniform(0, 0.02))
        process.send_signal(signal.SIGKILL)
        killed += process.wait() == -signal.SIGKILL
        resumed += 0 < already < 90
        if (broken / "depth.txt").exists():
            assert tree(broken) == expected
            shutil.rmtree(broken)
    subprocess.run([*command, "--out", str(broken)], check=True, capture_output=True)
    assert tree(broken) == expected
    assert killed >= 7, "most of the runs should have been broken off"
    assert resumed >= 3, "several should have gone on from a broken-off run"


def test_ctrl_c_keeps_whole_frames_and_says_so(room: Path, tmp_path: Path) -> None:
    path = "circle:center=0/0/1.2,radius=0.5,speed=1,heading=outward,laps=200"

    def heed_ctrl_c() -> None:
        # A shell that starts the tests in the background has them, and all that they start, ignore it.
        signal.signal(signal.SIGINT, signal.default_int_handler)

    command = [
        sys.executable,
        "-m",
        "depthsim",
        "generate",
        str(room),
        "--trajectory",
        path,
        "--out",
        str(tmp_path / "run"),
    ]
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, preexec_fn=heed_ctrl_c)  # noqa: PLW1509
    try:
        while process.poll() is None and not list((tmp_path / "run" / "depth").glob("[0-9]*.png")):
            time.sleep(0.005)
        process.send_signal(signal.SIGINT)
        _, reported = process.communicate(timeout=60)
    finally:
        process.kill()
    assert process.returncode == 130
    assert reported.strip().splitlines() == ["stopped; whole frames are kept, and the same command goes on from there"]
    assert not list((tmp_path / "run").rglob("*.tmp"))


def test_another_run_in_the_folder_is_refused(room: Path, tmp_path: Path) -> None:
    out = make(room, tmp_path / "run")
    before = tree(out)
    result = depthsim_here("generate", room, "--like", out, "--seed", 8, "--out", out)
    assert result.returncode == 2
    assert "seed" in result.stderr or "profile" in result.stderr or "materials" in result.stderr
    assert result.stderr.count("\n") == 1
    assert tree(out) == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["generate", "--out", "x"], ["no scene", "generate office"]),
        (["generate", "nosuch", "--out", "x"], ["nosuch", "no such scene", "office"]),
        (["generate", "room.obj", "--out", "x"], ["trajectory"]),
        (["generate", "room.obj", "--trajectory", "nosuch", "--out", "x"], ["nosuch", "no trajectory"]),
        (["generate", "room.obj", "--trajectory", "nosuch.txt", "--out", "x"], ["nosuch.txt", "no such file"]),
        (["generate", "room.obj", "--sensor", "nosuch", "--out", "x"], ["nosuch", "paper"]),
        (["generate", "room.obj", "--camera", "d999", "--out", "x"], ["d999", "d435"]),
        (["generate", "room.obj", "--resolution", "848", "--out", "x"], ["848", "848x480"]),
        (["generate", "room.obj", "--tag", "cement", "--out", "x"], ["--tag", "NAME=TAG"]),
        (["generate", "room.obj", "--tag", "cement=kryptonite", "--out", "x"], ["kryptonite", "the tags are"]),
        (["generate", "room.obj", "--units", "furlong", "--out", "x"], ["furlong"]),
        (["generate", "--like", "nosuch", "--out", "x"], ["nosuch", "no such folder"]),
        (["generate", "room.obj", "--materials", "nosuch.yaml", "--out", "x"], ["nosuch.yaml", "no such file"]),
        (["inspect", "nosuch"], ["nosuch", "no such scene"]),
        (["view", "nosuch"], ["nosuch", "no such scene"]),
    ],
)
def test_bad_calls_are_reported_in_one_line(room: Path, tmp_path: Path, arguments: list[str], words: list[str]) -> None:
    result = depthsim_here(*arguments, cwd=tmp_path)
    assert result.returncode == 2, result.stderr
    assert "Traceback" not in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1, result.stderr
    for word in words:
        assert word in result.stderr
    assert not (tmp_path / "x").exists(), "nothing is left of a run that could not begin"


def test_start_up_imports_nothing_heavy() -> None:
    heavy = ("numpy", "numba", "trimesh", "scipy", "viser", "pydantic")
    code = f"import sys, depthsim.cli; print([name for name in {heavy} if name in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_a_simulation_loads_no_more_of_scipy_than_it_uses() -> None:
    """It would take half as long again to start a command."""
    heavy = ("scipy.interpolate", "scipy.optimize", "scipy.spatial", "trimesh")
    code = f"""
import sys, depthsim.runs.generate, depthsim.sensor as sensor
sensor.load_profile("d435")
print([name for name in {heavy} if name in sys.modules])
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"


def test_no_open3d_is_needed(room: Path, tmp_path: Path) -> None:
    hidden = tmp_path / "hidden"
    (hidden / "open3d").mkdir(parents=True)
    (hidden / "open3d" / "__init__.py").write_text("raise ImportError('hidden by the test')\n")
    path = "hover:position=0/0/1.2,look_at=2/0/1.2,duration=0.1"
    command = [
        sys.executable,
        "-m",
        "depthsim",
        "generate",
        str(room),
        "--trajectory",
        path,
        "--out",
        str(tmp_path / "run"),
    ]
    result = subprocess.run(
        command, capture_output=True, text=True, check=False, env={**os.environ, "PYTHONPATH": str(hidden)}
    )
    assert result.returncode == 0, result.stderr


def test_open3d_makes_a_cloud_that_lies_on_the_mesh(room: Path, tmp_path: Path) -> None:
    try:
        o3d = load_open3d()
    except InputError as error:
        pytest.skip(str(error))
    run = Run.open(make(room, tmp_path / "run", profile="clean", frames=2))
    camera, frame = run.camera, run.path / "depth" / run.files[1].name
    lens = o3d.camera.PinholeCameraIntrinsic(camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy)
    image = o3d.io.read_image(str(frame))
    extrinsic = np.linalg.inv(run.poses[1])
    cloud = o3d.geometry.PointCloud.create_from_depth_image(image, lens, extrinsic, 1 / camera.depth_scale, 100.0)
    points = np.asarray(cloud.points, np.float32)
    assert len(points) == camera.width * camera.height
    scene = load_scene(room, materials=MATERIALS)
    mesh = o3d.t.geometry.RaycastingScene()
    mesh.add_triangles(o3d.core.Tensor(scene.vertices.astype(np.float32)), o3d.core.Tensor(scene.faces))
    distance = mesh.compute_distance(o3d.core.Tensor(points)).numpy()
    # Half a unit of depth, along a ray that may be 1.5 times as long as its depth.
    assert distance.max() < 0.75 * camera.depth_scale + 1e-5
