"""What the viewer's page is made of, without a browser."""

import json
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from shapes import MATERIALS, as_scene, camera, wall

from depthsim.errors import InputError
from depthsim.gap.diagnosis import Cause, Diagnosis, Gap, Task
from depthsim.sensor import Sensor
from depthsim.sensor.effect import Effect, effect_class, effect_ids, parameters_of
from viewer import Stage, Viewer, colours
from viewer.cloud import make_cloud
from viewer.controls.ranges import parameter_range
from viewer.files import place_for
from viewer.meshes import by_material, by_share
from viewer.opening import open_stage
from viewer.pace import AIM, Pace
from viewer.paint import Span, paint
from viewer.report import load_report, load_shares
from viewer.shot import Shot
from viewer.worker import Worker

CAMERA = camera(64, 48, 50)


def shot(profile: str = "paper", distance: float = 2.0) -> Shot:
    scene = as_scene(wall(distance), tags=["cement"])
    measured = Sensor(scene, CAMERA, profile, MATERIALS).measure(np.eye(4), seed=3)
    return Shot(CAMERA, np.eye(4), measured.depth_raw, measured.clean.depth, measured.clean.tag)


# Colours


def test_depth_runs_through_the_colours_from_near_to_far() -> None:
    one = shot("clean")
    assert (paint(one, "depth", Span(2.0, 8.0), ("cement",), MATERIALS).index == 0).all()
    assert (paint(one, "depth", Span(0.5, 2.0), ("cement",), MATERIALS).index == 255).all()
    assert (paint(one, "depth", Span(1.0, 4.0), ("cement",), MATERIALS).index == 127).all()


def test_what_is_too_far_is_red_and_what_is_right_nearly_white() -> None:
    one = shot("clean")
    off = Shot(CAMERA, one.pose, (one.depth_raw + 40).astype(np.uint16), one.clean)
    right = paint(one, "error", Span(error=0.05), (), MATERIALS).picture()[0, 0]
    far = paint(off, "error", Span(error=0.05), (), MATERIALS).picture()[0, 0]
    assert right.min() > 235
    assert far[0] > far[2] + 100


def test_the_fate_of_every_pixel_is_reported() -> None:
    units = np.full(CAMERA.shape, 1000, np.uint16)
    units[0], units[1] = 0, 65535
    clean = np.full(CAMERA.shape, 1.0, np.float32)
    clean[0, 0] = 0
    index = paint(Shot(CAMERA, np.eye(4), units, clean), "validity", Span(), (), MATERIALS).index
    reported = [colours.FATES[index[v, u]] for v, u in ((0, 0), (0, 1), (1, 0), (2, 0))]
    assert reported == ["nothing there", "hole", "too far", "valid"]


def test_a_span_stays_while_it_fits_and_moves_when_it_does_not() -> None:
    near = shot(distance=2.0)
    span = Span().fitted(near)
    assert span.near <= 2.0 <= span.far
    assert span.fitted(shot(distance=2.1)) == span
    assert span.fitted(shot("clean", 20.0)).near > 10


# Clouds


def test_the_cloud_is_the_depth_along_the_rays() -> None:
    one = shot()
    cloud = make_cloud(one, paint(one, "depth", Span(), (), MATERIALS))
    back = one.depth_raw > 0
    assert len(cloud.points) == back.sum()
    assert cloud.points[:, 2] == pytest.approx(one.depth_raw[back] * 0.001)
    rows, columns = np.nonzero(back)
    assert cloud.points[:, 0] / cloud.points[:, 2] * CAMERA.fx + CAMERA.cx == pytest.approx(columns, abs=1e-3)
    assert cloud.points[:, 1] / cloud.points[:, 2] * CAMERA.fy + CAMERA.cy == pytest.approx(rows, abs=1e-3)


@pytest.mark.parametrize("one_in", [2, 3, 4, 8, 13])
def test_a_thinned_cloud_has_one_point_in_so_many_evenly_spread(one_in: int) -> None:
    one = shot("clean")
    points = make_cloud(one, paint(one, "depth", Span(), (), MATERIALS), one_in).points
    assert len(points) == pytest.approx(CAMERA.width * CAMERA.height / one_in, rel=0.02)
    cells, _, _ = np.histogram2d(points[:, 0], points[:, 1], bins=4)
    assert cells.std() / cells.mean() < 0.1


def test_holes_are_shown_where_the_surface_is_if_asked() -> None:
    one = shot()
    painted = paint(one, "validity", Span(), (), MATERIALS)
    assert len(make_cloud(one, painted, with_holes=True).points) == one.depth_raw.size
    assert len(make_cloud(one, painted).points) < one.depth_raw.size


# Meshes


def test_all_faces_are_in_a_group_of_their_colour() -> None:
    scene = as_scene(wall(1.0), wall(2.0), tags=["cement", "plastic"])
    groups = {group.name: group for group in by_material(scene, MATERIALS)}
    assert set(groups) == {"cement", "plastic"}
    assert {float(z) for z in groups["plastic"].vertices[:, 2]} == {2.0}
    shares = np.array([0, 0, 0.5, 0.5], np.float32)
    shared = by_share(scene, shares)
    assert sum(len(group.faces) for group in shared) == 4
    worst = max(shared, key=lambda group: sum(group.colour))
    assert set(worst.vertices[:, 2]) == {2.0}


# Sliders


@pytest.mark.parametrize("effect_id", effect_ids())
def test_every_slider_can_show_its_default_and_grows_to_its_bounds(effect_id: str) -> None:
    kind = effect_class(effect_id)
    for name in parameters_of(kind):
        field, span = kind.model_fields[name], parameter_range(kind, name)
        assert span.low <= span.default <= span.top <= span.high
        assert 0 < span.step <= (span.top - span.low) / 2 or span.whole
        if field.default_factory is None:
            assert span.default == field.default
            assert span.within(span.high) == span.high
            for value in (span.low, span.high, span.default):
                kind(**{name: span.within(value)})


# Names from the browser


@pytest.mark.parametrize(
    "name", ["../evil", "a/b", "/etc/passwd", "..", "", ".hidden", "a\0b", "a\\b", "x" * 80, "a\nb", "ä", "-rf"]
)
def test_a_name_that_is_not_a_plain_one_is_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="no plain file name"):
        place_for(tmp_path, name, ".yaml")


def test_a_name_that_is_taken_or_leads_elsewhere_is_refused(tmp_path: Path) -> None:
    (tmp_path / "here.yaml").write_text("")
    (tmp_path / "away.yaml").symlink_to("/tmp/elsewhere.yaml")
    assert place_for(tmp_path, "new", ".yaml") == tmp_path / "new.yaml"
    assert place_for(tmp_path, "new.yaml", ".yaml") == tmp_path / "new.yaml"
    for taken in ("here", "away"):
        with pytest.raises(InputError):
            place_for(tmp_path, taken, ".yaml")


# The worker


def test_of_jobs_of_one_kind_that_wait_the_latest_is_done() -> None:
    done: list[int] = []
    begun, go_on = threading.Event(), threading.Event()
    worker = Worker(lambda _: None, lambda *_: None)
    worker.ask("first", lambda: (begun.set(), go_on.wait(5), None)[2])
    begun.wait(5)
    for number in range(20):
        worker.ask("frame", lambda number=number: done.append(number))
    finished = threading.Event()
    worker.ask("last", finished.set)
    go_on.set()
    assert finished.wait(5)
    worker.close()
    assert done == [19]


def test_a_job_that_fails_is_reported_in_one_line_and_the_next_one_is_done(capsys: pytest.CaptureFixture[str]) -> None:
    reported: list[tuple[str, str]] = []
    worker = Worker(lambda _: None, lambda kind, line: reported.append((kind, line)))

    def bad() -> None:
        raise InputError("file", "line 3", "is bad", "correct it")

    worker.ask("frame", bad)
    while not reported:
        time.sleep(0.01)
    worker.ask("frame", lambda: None)
    worker.ask("other", lambda: 1 / 0)  # type: ignore[arg-type,return-value]
    while len(reported) < 3:
        time.sleep(0.01)
    worker.close()
    assert reported[:2] == [("frame", "file: line 3: is bad; correct it"), ("frame", "")]
    assert reported[2][0] == "other"
    assert "ZeroDivisionError" in reported[2][1]
    assert "\n" not in reported[2][1]


ENDS_WITH_A_JOB_UNDER_WAY = """
import threading, time
from viewer.worker import Worker
begun = threading.Event()
Worker(lambda _: None, lambda *_: None).ask("frame", lambda: (begun.set(), time.sleep(0.5), print("done")))
begun.wait()
"""


def test_a_process_ends_after_the_job_that_is_under_way() -> None:
    """A thread that is ended in the ray caster takes the process with it, by SIGSEGV or SIGABRT."""
    command = [sys.executable, "-c", ENDS_WITH_A_JOB_UNDER_WAY]
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[2])
    assert (result.returncode, result.stdout, result.stderr) == (0, "done\n", "")


def test_a_browser_that_is_too_slow_gets_a_thinner_cloud_and_a_quick_one_all(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(time, "monotonic", lambda: clock[0])
    pace = Pace()

    def play(frames: int) -> None:
        for _ in range(frames):
            clock[0] += 0.012 + 0.3 / pace.one_in  # a browser that takes 0.3 s for all points
            pace.taken(30)

    play(60)
    assert pace.rate is not None
    assert pace.rate >= AIM
    assert 3 <= pace.one_in <= 8
    quick = Pace()
    for _ in range(60):
        clock[0] += 0.03
        quick.taken(30)
    assert quick.one_in == 1
    slow_recording = Pace()
    for _ in range(60):
        clock[0] += 0.2
        slow_recording.taken(5)  # five frames a second are all there is
    assert slow_recording.one_in == 1


# Reports


def write_report(folder: Path, run: Path, where: bool = True) -> Path:
    """A report as `diagnose` writes it: a fill rate and a disparity noise in place of the paper's law."""
    folder.mkdir()
    causes = (
        Cause(effect="disparity_noise", parameters={"sigma": 0.2}, closed_fraction=0.6, ci95_closed=(0.5, 0.7)),
        Cause(effect="fill_rate", parameters={"rate": 0.3}, closed_fraction=0.3, ci95_closed=(0.2, 0.4)),
    )
    gap = Gap(measure="bits", unit="bit", before=1.0, after=0.1, floor=0.0, closed_fraction=0.9, ci95=(0.8, 1.0))
    off = {"recording": (1.0, 3.0), "before": (8.0, 10.0), "before_off": (5.0, 9.0)}
    tasks = (Task(name="plane_rms", unit="mm", recording=2.0, before=9.0, after=2.1, ci95=off),)
    Diagnosis(verdict="explained", gap=gap, where=(), causes=causes, unexplained=None, tasks=tasks).write(folder)
    (folder / "sensor.yaml").write_text("effects:\n- disparity_noise: {sigma: 0.2}\n- fill_rate: {rate: 0.3}\n")
    (folder / "report.yaml").write_text(json.dumps({"run": str(run), "sensor": "paper"}))
    if where:
        np.savez(folder / "where.npz", face_share=np.full(2, 0.5, np.float32), image_share=np.eye(4, dtype=np.float32))
    return folder


def ids(effects: tuple[Effect, ...]) -> set[str]:
    return {effect.id for effect in effects}


def test_causes_are_added_one_by_one_and_all_of_them_are_the_fitted_sensor(tmp_path: Path) -> None:
    report, origin = load_report(write_report(tmp_path / "report", tmp_path / "run"))
    assert origin.run == str(tmp_path / "run")
    assert report.effects(set()) == report.before.effects
    assert report.effects({0, 1}) == report.after.effects
    noise = report.effects({0})
    assert ids(noise) == {"disparity_noise", "fill_rate"}  # the paper's law of noise goes for the other one
    assert [effect.model_dump() for effect in noise if effect.id == "fill_rate"] == [{"rate": 0.01}]
    holes = report.effects({1})
    assert ids(holes) == {"material_noise", "fill_rate"}
    assert [effect.model_dump() for effect in holes if effect.id == "fill_rate"] == [{"rate": 0.3}]


def test_the_gap_follows_the_causes(tmp_path: Path) -> None:
    report, _ = load_report(write_report(tmp_path / "report", tmp_path / "run"))
    assert report.gap(set()) == 1.0
    assert report.gap({0, 1}) == pytest.approx(0.1)
    assert report.gap({0}) == pytest.approx(0.4)
    assert report.gap({1}) == pytest.approx(0.7)


def test_shares_are_read_checked_and_not_missed(tmp_path: Path) -> None:
    folder = write_report(tmp_path / "report", tmp_path / "run", where=False)
    assert load_shares(folder, 2) is None
    np.savez(folder / "where.npz", face_share=np.ones(3, np.float32), image_share=np.ones((2, 2), np.float32))
    with pytest.raises(InputError, match="the scene has 2 faces"):
        load_shares(folder, 2)
    (folder / "where.npz").write_bytes(b"not a zip file")
    with pytest.raises(InputError, match=r"where\.npz"):
        load_shares(folder, 2)


def test_a_report_that_lacks_something_is_reported_in_one_line(tmp_path: Path) -> None:
    folder = write_report(tmp_path / "report", tmp_path / "run")
    with pytest.raises(InputError, match="run"):
        open_stage(folder)  # the run is not there
    (folder / "report.yaml").unlink()
    with pytest.raises(InputError, match=r"report\.yaml.*no such file"):
        open_stage(folder)
    (folder / "sensor.yaml").unlink()
    (folder / "vehicle.yaml").write_text("name: f450")
    with pytest.raises(InputError, match="the report of a flight"):
        open_stage(folder)
    for text in ("{", "[" * 100_000):
        (folder / "diagnosis.json").write_text(text)
        with pytest.raises(InputError, match="is not JSON"):
            open_stage(folder)


def test_ctrl_c_as_soon_as_the_address_is_read_ends_it_as_any_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read_and_pressed(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    viewer = Viewer(broken, "here", port=0, folder=tmp_path)
    monkeypatch.setattr("builtins.print", read_and_pressed)
    viewer.run("shown")


def broken() -> Stage:
    raise InputError("run", "", "is broken", "make it again")


def test_the_page_is_for_this_machine_alone(tmp_path: Path) -> None:
    """Who listens everywhere is reached at 127.0.0.2 too."""
    viewer = Viewer(broken, "here", port=0, folder=tmp_path)
    try:
        port = int(viewer.url.rstrip("/").rpartition(":")[2])
        socket.create_connection(("127.0.0.1", port), timeout=10).close()
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.2", port), timeout=10)
    finally:
        viewer.stop()
