"""What a gap costs: each figure against a truth that is known, and the three of them on any recording."""

import shutil
from dataclasses import replace
from functools import cache
from html import escape
from pathlib import Path

import numpy as np
import pytest
from reports import LACKED, OTHERS, PAPER, found, recorded
from rich.console import Console
from shapes import camera
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.gap import Diagnosis, diagnose
from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.report.drawing import measure_drawing
from depthsim.gap.depth.report.page import report_page
from depthsim.gap.depth.tasks.figures import FIGURES
from depthsim.gap.depth.tasks.measure import measure_tasks, tasks_of
from depthsim.gap.depth.tasks.obstacles import obstacle_figures, occupancy
from depthsim.gap.depth.tasks.patches import (
    ACCURACY,
    DISTANCE,
    PLANE,
    SUBPIXEL,
    cut_patches,
    flat_patches,
    noise_between,
    plane_errors,
)
from depthsim.gap.depth.tasks.pixels import pixel_figures
from depthsim.gap.depth.tasks.view import Floats, View
from depthsim.gap.diagnosis import Task
from depthsim.gap.report.terminal import show
from depthsim.gap.report.words import Origin, task_name, task_row
from depthsim.runs import Run
from depthsim.runs.png import encode_png
from depthsim.sensor import load_profile
from depthsim.sensor.effect import Effect
from depthsim.sensor.effects.pose_noise import PoseNoise
from depthsim.sensor.profile import profile_names

CAMERA = camera(320, 240, 200.0)
RNG = np.random.default_rng(7)


def view_of(clean: Floats, across: Floats | None = None, index: int = 3) -> View:
    beyond = np.zeros_like(clean) if across is None else across
    return View(index, CAMERA, clean, beyond, np.ones(clean.shape, np.bool_))


def slanted(degrees: float, distance: float = 2.0) -> Floats:
    """(240, 320) z-depth [m] of a wall that is turned about the upright axis."""
    x, _ = CAMERA.rays
    return np.asarray(distance / (1 + x * np.tan(np.radians(degrees))), np.float32)


@pytest.mark.parametrize(("degrees", "dependent"), [(0.0, 2), (30.0, 2), (50.0, 0)])
def test_noise_about_a_plane_is_what_librealsense_would_say(degrees: float, dependent: int) -> None:
    """Against the same in NumPy. dependent: the coordinate that its least squares explain by the other two."""
    clean = slanted(degrees)
    view, patches = view_of(clean), cut_patches(view_of(clean))
    depth = (clean + RNG.normal(0, 0.01, clean.shape)).astype(np.float32)
    assert len(patches) == 16 * 16 and (degrees > 30 or len(flat_patches(view)) == len(patches))
    errors, chosen = plane_errors(view, depth, patches), 40
    top, bottom, left, right = patches[chosen]
    z = depth[top:bottom, left:right].astype(float).ravel()
    points = np.column_stack([rays[top:bottom, left:right].ravel() * z for rays in CAMERA.rays] + [z])
    matrix = points.copy()
    matrix[:, dependent] = 1
    slopes = np.linalg.lstsq(matrix, points[:, dependent], rcond=None)[0]
    normal, offset = slopes.copy(), slopes[dependent]
    normal[dependent] = -1
    length = np.linalg.norm(normal)
    kept = points[np.argsort(z)[len(z) // 200 : len(z) - len(z) // 200]]
    off = (kept @ normal + offset) / length
    foot = kept - off[:, None] * normal / length
    disparities = CAMERA.focal_baseline * (1 / np.linalg.norm(kept, axis=1) - 1 / np.linalg.norm(foot, axis=1))
    assert errors[chosen, PLANE] == pytest.approx(np.sqrt((off**2).mean()), rel=1e-5)
    assert errors[chosen, SUBPIXEL] == pytest.approx(np.sqrt((disparities**2).mean()), rel=1e-4)
    if degrees == 0:
        assert errors[:, PLANE].mean() == pytest.approx(0.01, rel=0.05)
    clean_errors = plane_errors(view, clean, patches)
    assert clean_errors[clean_errors[:, DISTANCE] < 4][:, [PLANE, ACCURACY]].max() < 1e-5


def test_the_accuracy_is_a_scale_and_holes_are_no_plane() -> None:
    clean = slanted(0)
    view, patches = view_of(clean), flat_patches(view_of(clean))
    depth = (1.02 * clean).astype(np.float32)
    depth[:, :160] = 0
    found = plane_errors(view, depth, patches)
    seen = patches[:, 2] >= 160
    assert np.isnan(found[~seen]).all() and found[seen, ACCURACY] == pytest.approx(0.02, rel=1e-3)


def test_a_ball_is_no_plane() -> None:
    x, y = CAMERA.rays
    clean = np.asarray(2 + 2 * (x**2 + y**2) + 0.05 * np.sin(60 * x), np.float32)
    assert len(flat_patches(view_of(clean))) == 0


def test_the_noise_in_time_is_that_of_a_pixel_wherever_the_camera_moves() -> None:
    one, other = view_of(slanted(0)), view_of(slanted(20, 2.3))
    noisy = [(view.clean + RNG.normal(0, 0.004, view.clean.shape)).astype(np.float32) for view in (one, other)]
    noise = noise_between(other, noisy[1], one, noisy[0], cut_patches(one))
    assert noise.mean() == pytest.approx(0.004, rel=0.02)
    assert np.isnan(noise_between(other, 0 * noisy[1], one, noisy[0], cut_patches(one))).all()


def test_holes_and_what_flies_beside_an_edge() -> None:
    clean = slanted(0)
    clean[:, 160:] = 3
    across = np.zeros_like(clean)
    across[:, 150:160], across[:, 160:170] = 3, 2
    depth = clean.copy()
    depth[10:14, 10:14] = 0  # one hole of 16 pixels and four of one
    depth[30:38:2, 30] = 0
    depth[:24, 158:162] = 2.5  # 96 of the 240 x 20 beside the edge
    figures = pixel_figures(view_of(clean, across), depth)
    assert figures["fill_rate"] == (100 * (240 * 320 - 20), 240 * 320)
    assert figures["hole_width"] == (16 * 4 + 4, 20)
    assert figures["flying_pixels"] == (100 * 96, 240 * 20)


@pytest.mark.parametrize(
    ("shift", "free", "occupied"), [(0.0, 0.0, False), (0.5, 100.0, False), (-0.5, 0.0, True), (-9.0, 0.0, False)]
)
def test_a_wall_is_an_obstacle_where_it_is(shift: float, free: float, occupied: bool) -> None:
    clean = slanted(0)
    view = view_of(clean)
    truth = occupancy(view, clean)
    assert set(np.unique(truth)) == {0, 1, 2}
    figures = obstacle_figures(truth, occupancy(view, np.maximum(clean + np.float32(shift), 0)))
    wrong, walls = figures["voxels_wrongly_free"]
    assert walls == pytest.approx(32 * 24, rel=0.1)  # 3.2 m x 2.4 m of wall, in voxels of 0.1 m
    assert wrong / walls == pytest.approx(free, abs=6)  # wider rays pass beside it
    assert (figures["voxels_wrongly_occupied"][0] > 100 * 300) == occupied


@cache
def evidence(effects: str = LACKED, settings: tuple[str, ...] = (), threads: int = 1, width: int = 106) -> Evidence:
    config = DepthConfig.varied(settings)
    return load_evidence(recorded(effects, rate=3.0, width=width), None, "paper", threads=threads, config=config)[0]


def by_name(tasks: tuple[Task, ...]) -> dict[str, Task]:
    assert [task.name for task in tasks] == list(FIGURES)
    return {task.name: task for task in tasks}


def test_the_causes_bring_the_figures_nearer() -> None:
    tasks = by_name(found().diagnosis.tasks)
    for name in ("plane_rms", "voxels_wrongly_free", "voxels_wrongly_occupied"):
        task = tasks[name]
        assert task.recording and task.before and task.after
        assert abs(task.after / task.recording - 1) < 0.15
        assert abs(task.before / task.recording - 1) > 0.5


def test_without_a_gap_after_is_as_before() -> None:
    tasks = found(PAPER).diagnosis.tasks
    assert found(PAPER).diagnosis.verdict == "no_gap"
    assert all(task.after == task.before for task in tasks) and len(tasks) == len(FIGURES)


def test_all_is_as_it_was_whatever_the_threads_and_whether_asked_for() -> None:
    given, paper = recorded(LACKED), load_profile("paper")
    plain = diagnose(given, sensor=paper, without=OTHERS, threads=1, tasks=False)
    assert "tasks" not in plain.to_json()
    assert plain.to_json() == found().diagnosis.model_copy(update={"tasks": ()}).to_json()
    assert tasks_of(found()) == found().diagnosis.tasks
    one, two = (measure_tasks(evidence(threads=threads), [paper.effects]) for threads in (1, 2))
    assert one == two
    assert Diagnosis.model_validate_json(found().diagnosis.to_json()) == found().diagnosis


@pytest.mark.parametrize("settings", [(), ("data.pixels=1", "data.least_rows=105")])
@pytest.mark.parametrize("name", sorted(profile_names()))
def test_every_profile_has_figures_on_frames_and_on_bands_of_rows(name: str, settings: tuple[str, ...]) -> None:
    profile = load_profile(name)
    if profile.stereo is not None:
        pytest.skip("active stereo is not diagnosed")
    looked = evidence(settings=settings, width=212 if settings else 106)
    assert (looked.rows < looked.camera.height) == bool(settings)
    tasks = by_name(measure_tasks(looked, [looked.base, profile.effects]))
    assert all(task.recording is not None or task.reason for task in tasks.values())
    assert (tasks["fill_rate"].after or 0) > 30


def spoilt(folder: Path, share: float, holes: bool) -> Evidence:
    """The evidence with masks over the left ``share`` of the picture, and perhaps without any depth."""
    shutil.copytree(recorded(LACKED, rate=3.0), folder / "run")
    opened = Run.open(folder / "run")
    mask = np.full(opened.camera.shape, 255, np.uint8)
    mask[:, : round(share * opened.camera.width)] = 0
    (folder / "run" / "mask").mkdir()
    for file in opened.files:
        (folder / "run" / "mask" / file.name).write_bytes(encode_png(mask))
        if holes:
            file.write_bytes(encode_png(np.zeros(mask.shape, np.uint16)))
    return load_evidence(folder / "run", None, "paper", threads=1)[0]


@pytest.mark.parametrize(("share", "holes"), [(0.5, False), (1.0, False), (0.0, True)])
def test_what_is_masked_is_not_asked_for_and_what_is_not_there_has_a_reason(
    tmp_path: Path, share: float, holes: bool
) -> None:
    looked = spoilt(tmp_path, share, holes)
    tasks = by_name(measure_tasks(looked, [looked.base, looked.base]))
    for task in tasks.values():
        assert bool(task.reason) == (None in (task.recording, task.before, task.after))
    if share == 1.0:
        assert all(task.recording is None and task.reason and not task.ci95 for task in tasks.values())
    elif holes:
        assert tasks["fill_rate"].recording == 0 and tasks["plane_rms"].before is None
        assert tasks["voxels_wrongly_free"].recording == 0 and (tasks["fill_rate"].before or 0) > 90
    else:
        assert tasks["fill_rate"].recording != by_name(measure_tasks(evidence(), [looked.base]))["fill_rate"].recording


def test_poses_that_are_off_cost_accuracy_and_obstacles() -> None:
    looked = evidence(PAPER)
    shaken: list[Effect] = [*looked.base, PoseNoise(translation=0.1, rotation=2.0)]
    tasks = by_name(measure_tasks(looked, [looked.base, shaken]))
    for name in ("z_accuracy", "voxels_wrongly_free"):
        assert (tasks[name].after or 0) > 1.5 * (tasks[name].before or 0) > 0


def test_terminal_and_page_have_the_table() -> None:
    diagnosis, origin = found().diagnosis, Origin(run="run", report="report", sensor="paper")
    console = Console(width=100, record=True, file=None, highlight=False)
    with console.capture() as caught:
        show(console, diagnosis, origin)
    assert "What it costs" in caught.get() and "voxels wrongly free [%]" in caught.get()
    page = report_page(diagnosis, measure_drawing(found(), origin))
    assert all(task_name(name) in page and escape(figure.about) in page for name, figure in FIGURES.items())
    bare = replace(found(), diagnosis=diagnosis.model_copy(update={"tasks": ()}))
    assert "What the gap costs" not in report_page(bare.diagnosis, measure_drawing(bare, origin))


def test_an_interval_is_half_of_it_or_its_ends_where_it_is_lopsided() -> None:
    full = Task(
        name="fill_rate", unit="%", recording=99.8, before=98.9967, after=99, ci95={"before": (98.9901, 99.0034)}
    )
    assert task_row(full, causes=False) == ["fill rate [%]", "99.8", "99 ± 0.0067"], "rounding makes nothing lopsided"
    ends = {"recording": (1.0, 3.0), "before": (0.5, 257.0), "before_off": (0.1, 255.0)}
    task = Task(name="drift_kiss_icp", unit="%", recording=2, before=2.1, after=None, ci95=ends, reason="none")
    assert task_row(task, causes=True) == ["drift KISS-ICP [%]", "2 ± 1", "2.1 (0.5 to 257) *", "-"]


def test_the_command_line_leaves_them_out(tmp_path: Path) -> None:
    words = ["diagnose", str(recorded(PAPER)), "--sensor", "paper", "--threads", "1"]
    words += [word for name in OTHERS for word in ("--without", name)]
    for flags, there in (([], True), (["--no-tasks"], False)):
        result = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "report"), *flags])
        assert result.exit_code == 0 and ("What it costs" in result.output) == there
        assert bool(Diagnosis.read(tmp_path / "report").tasks) == there
