"""The viewer's page in a real headless Chromium."""

import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from browser import PATIENCE, WHY_NOT, Visit, frame_after, until, visit, wall_run
from test_viewer_parts import write_report

from benchmarks.chromium import chromium
from depthsim.runs import Run
from depthsim.runs.png import decode_png
from depthsim.sensor import load_profile
from depthsim.sensor.effect import effect_class, effect_ids, parameters_of
from viewer import Viewer, open_stage
from viewer.session import Session

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT or "there is a browser")


@pytest.fixture(scope="module")
def browser() -> Iterator["Browser"]:
    with chromium() as one:
        yield one


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return wall_run(tmp_path_factory.mktemp("viewer") / "run")


@pytest.fixture(scope="module")
def viewer(run: Path) -> Iterator[Viewer]:
    stage = open_stage(run)
    one = Viewer(lambda: stage, "test", port=0, folder=run.parent / "saved")
    yield one
    one.stop()


@pytest.fixture
def guest(browser: "Browser", viewer: Viewer) -> Iterator[Visit]:
    with visit(browser, viewer) as one:
        yield one


def noise(session: Session) -> float:
    """Standard deviation of what the last cloud has measured [m], as the server knows it."""
    assert session.shown is not None
    shot = session.shown.shots[0]
    assert shot.clean is not None
    back = (shot.depth_raw > 0) & (shot.clean > 0)
    return float((shot.depth_raw[back] * shot.camera.depth_scale - shot.clean[back]).std())


def test_the_page_loads_without_an_error_in_its_console(guest: Visit) -> None:
    session = guest.open()
    assert guest.page.get_by_text("64x48").first.is_visible()
    guest.page.locator("canvas").first.wait_for()
    guest.page.wait_for_timeout(500)
    assert guest.errors == []
    assert session.shown is not None
    assert session.shown.sides == ("recording",)
    assert session.shown.points == np.count_nonzero(session.shown.shots[0].depth_raw)


def test_every_effect_has_its_folder_with_a_control_for_each_parameter(guest: Visit) -> None:
    session = guest.open()
    guest.tab("Sensor")
    guest.page.get_by_text("heavy_tails").first.wait_for()
    text = guest.page.locator("body").inner_text().replace("● ", "")
    assert [effect_id for effect_id in effect_ids() if effect_id not in text.split()] == []
    guest.page.get_by_text("invalid_band", exact=True).click()
    guest.page.get_by_text("margin [px]").wait_for()
    for effect_id in effect_ids():
        names = set(parameters_of(effect_class(effect_id)))
        folder = session.effects.folders[effect_id]
        assert set(folder.parameters) == names


def test_a_larger_m_makes_the_wall_thicker_by_what_the_law_says(guest: Visit) -> None:
    session = guest.open()
    guest.tab("Sensor")
    for m in (0.2, 1.5):
        frame_after(session, lambda m=m: guest.type_into("m cement [1/m]", m))
        until(lambda m=m: session.effects.folders["material_noise"].effect().m == {"cement": m})
        until(lambda: session.shown.sides == ("sensor",))
        distance = float(np.median(session.shown.shots[0].clean))
        law = 0.005 * np.exp(m * distance)
        until(lambda law=law: noise(session) == pytest.approx(law, rel=0.05))
    reported = 1000 * law

    def on_the_page() -> float:
        lines = guest.page.locator("body").inner_text().splitlines()
        line = next((line for line in lines if "noise" in line and "1σ" in line), "noise nan mm")
        return float(line.split("noise ")[1].split(" mm")[0])

    until(lambda: on_the_page() == pytest.approx(reported, rel=0.07))  # it is shown after the frame is sent


def test_scrubbing_shows_the_frame_that_is_on_disk(guest: Visit, run: Path) -> None:
    session = guest.open()
    frame_after(session, lambda: guest.type_into("frame", 3))
    until(lambda: session.shown.index == 3)
    np.testing.assert_array_equal(session.shown.shots[0].depth_raw, Run.open(run).depth_raw(3))
    guest.page.get_by_text("0.30 s").first.wait_for()


def test_play_goes_on_by_itself_until_it_is_stopped(guest: Visit) -> None:
    session = guest.open()
    guest.page.keyboard.press("k")
    seen = set()

    def all_seen() -> bool:
        seen.add(session.shown.index)
        return len(seen) == 5

    until(all_seen)
    guest.page.keyboard.press("k")
    until(lambda: not session.playback.playing)


def test_without_a_gpu_a_play_is_pictures_of_the_view_and_at_rest_every_point_is_there(guest: Visit) -> None:
    session = guest.open()
    until(lambda: session._by_software)
    guest.page.keyboard.press("k")
    until(lambda: session.shown.pictured)
    guest.page.get_by_text("pictures of the view").first.wait_for()
    assert session.shown.one_in == 1
    uniforms = "window.__viserMutable.backgroundMaterial.uniforms"
    guest.page.wait_for_function(f"{uniforms}.enabled.value && {uniforms}.colorMap.value.image.width > 300")
    guest.page.wait_for_function("'drawOften' in window.__viserMutable")
    view = session.client.camera
    size = guest.page.evaluate(f"[{uniforms}.colorMap.value.image.width, {uniforms}.colorMap.value.image.height]")
    assert size == [view.image_width, view.image_height]
    cloud = "window.__viserSceneTree.getState()['/a/cloud']"
    guest.page.wait_for_function(f"!{cloud}.effectiveVisibility")
    guest.page.keyboard.press("k")
    until(lambda: session.shown.whole)
    guest.page.wait_for_function(f"!{uniforms}.enabled.value && {cloud}.effectiveVisibility")
    guest.page.wait_for_function("!('drawOften' in window.__viserMutable)")
    valid = int(np.count_nonzero(session.shown.shots[0].depth_raw))
    guest.page.wait_for_function(f"count => {cloud}.message.props.points.length === 3 * count", arg=valid)
    assert guest.errors == []


def test_clean_and_noisy_stand_side_by_side(guest: Visit) -> None:
    session = guest.open()
    session.look.show.value = "sensor"
    frame_after(session, lambda: setattr(session.look.beside, "value", "clean"))
    until(lambda: session.shown.sides == ("sensor", "clean"))
    noisy, clean = session.shown.shots
    assert np.abs(clean.depth_raw - 1000 * clean.clean).max() <= 0.51
    assert np.abs(noisy.depth_raw.astype(float) - 1000 * clean.clean).max() > 5
    guest.page.get_by_text("clean: 0.0% holes").first.wait_for()
    frame_after(session, lambda: setattr(session.look.beside, "value", "second sensor"))
    until(lambda: session.shown.sides == ("sensor", "second sensor"))
    for colouring in ("error", "material", "validity", "depth"):
        frame_after(session, lambda colouring=colouring: setattr(session.look.colouring, "value", colouring))
    assert guest.errors == []


def test_another_profile_and_another_resolution_are_measured(guest: Visit) -> None:
    session = guest.open()
    frame_after(session, lambda: setattr(session.sensor.profile, "value", "d435"))
    until(lambda: session.shown.sides == ("sensor",))
    assert {effect.id for effect in session.effects.effects()} == {e.id for e in load_profile("d435").effects}
    session.sensor.model.value = "d435"
    session.sensor.size.value = "424x240"
    until(lambda: session.shown.shots[0].depth_raw.shape == (240, 424))
    guest.page.get_by_text("424x240").first.wait_for()
    session.sensor.profile.value = "active_stereo"
    until(lambda: session.profile().stereo is not None)
    before = session.shown
    until(lambda: session.shown is not before)
    assert guest.errors == []


def test_two_browsers_have_settings_of_their_own(browser: "Browser", viewer: Viewer) -> None:
    with visit(browser, viewer) as first, visit(browser, viewer) as second:
        one = first.open()
        two = second.open()
        assert one is not two
        frame_after(one, lambda: setattr(one.playback._slider, "value", 2))
        until(lambda: one.shown.index == 2)
        assert two.shown is not None
        assert two.shown.index == 0


def test_profile_frame_and_picture_are_saved_and_read_back(guest: Visit, run: Path) -> None:
    session = guest.open()
    folder = run.parent / "saved"
    shutil.rmtree(folder, ignore_errors=True)
    guest.tab("Save")
    for button in ("save profile", "save frame", "save picture"):
        guest.page.get_by_role("button", name=button).click()
        guest.page.get_by_text("Saved").get_by_text(
            {"save profile": "mine.yaml", "save frame": "mine", "save picture": "mine.png"}[button]
        ).last.wait_for()
        until(lambda: session.status)
    assert load_profile(folder / "mine.yaml").effects == load_profile("paper").effects
    np.testing.assert_array_equal(Run.open(folder / "mine").depth_raw(0), session.shown.shots[0].depth_raw)
    picture = decode_png(folder / "mine.png")
    assert picture.shape[0] > 100
    assert picture.std() > 1


def test_a_name_that_leaves_the_folder_is_refused_on_the_page(guest: Visit, run: Path) -> None:
    session = guest.open()
    guest.tab("Save")
    session.save._name.value = "../../evil"
    guest.page.get_by_role("button", name="save profile").click()
    guest.page.get_by_text("is no plain file name").first.wait_for()
    assert not list(run.parent.parent.rglob("evil*"))


def test_a_menu_takes_only_what_it_offers(guest: Visit, tmp_path: Path) -> None:
    session = guest.open()
    (tmp_path / "secret.yaml").write_text("hunter2: 1234\n")
    session.sensor.second.value = str(tmp_path / "secret.yaml")
    session.look.beside.value = "second sensor"
    guest.page.get_by_text("is not among the choices").first.wait_for()
    assert "hunter2" not in guest.page.content()


def test_a_broken_frame_is_reported_in_its_one_line_and_the_page_goes_on(
    browser: "Browser", run: Path, tmp_path: Path
) -> None:
    broken = tmp_path / "broken"
    shutil.copytree(run, broken)
    bad = Run.open(broken).files[2]
    bad.write_bytes(bad.read_bytes()[:-20])
    viewer = Viewer(lambda: open_stage(broken), "broken", port=0, folder=tmp_path)
    try:
        with visit(browser, viewer) as guest:
            session = guest.open()
            guest.type_into("frame", 2)
            line = guest.page.locator(".depthsim-error")
            line.wait_for()
            assert str(bad) in line.inner_text()
            assert "is a damaged PNG" in line.inner_text()
            guest.type_into("frame", 3)
            until(lambda: session.shown.index == 3)
            line.wait_for(state="hidden")
            assert guest.errors == []
    finally:
        viewer.stop()


def test_a_run_that_cannot_be_opened_is_reported_and_opened_once_it_is_fixed(
    browser: "Browser", run: Path, tmp_path: Path
) -> None:
    broken = tmp_path / "broken"
    shutil.copytree(run, broken)
    (broken / "camera.yaml").unlink()
    viewer = Viewer(lambda: open_stage(broken), "broken", port=0, folder=tmp_path)
    try:
        assert viewer.error is not None
        with visit(browser, viewer) as guest:
            guest.page.goto(viewer.url)
            line = guest.page.locator(".depthsim-error")
            line.wait_for()
            assert line.inner_text() == str(viewer.error)
            shutil.copy(run / "camera.yaml", broken)
            guest.open()
            assert guest.errors == []
    finally:
        viewer.stop()


def test_what_takes_long_shows_progress_and_the_page_does_not_wait(guest: Visit) -> None:
    session, go_on = guest.open(), threading.Event()
    session.worker.ask("frame", lambda: (go_on.wait(PATIENCE), None)[1])
    guest.page.get_by_text("measuring …").wait_for()
    guest.tab("Save")
    guest.page.get_by_role("button", name="save frame").wait_for()
    assert guest.page.get_by_text("measuring …").is_visible()
    go_on.set()
    guest.page.get_by_text("measuring …").wait_for(state="hidden")


def test_the_keys_carry_the_sensor_and_speed_and_drag_are_reported(guest: Visit) -> None:
    session = guest.open()
    guest.tab("Fly")
    guest.control("fly by keyboard").click()
    until(lambda: session.shown.sides == ("sensor",))
    before = session.shown.shots[0].pose[:3, 3].copy()
    guest.page.mouse.click(420, 100)  # into the 3D view
    guest.page.keyboard.down("w")
    guest.page.wait_for_timeout(600)
    guest.page.keyboard.up("w")
    until(lambda: np.linalg.norm(session.shown.shots[0].pose[:3, 3] - before) > 0.05)
    guest.page.get_by_text("drag").first.wait_for()


def test_a_path_is_flown_with_speed_and_drag(guest: Visit) -> None:
    session = guest.open()
    guest.tab("Fly")
    session.fly._path.value = "circle:radius=1,center=-3/0/10"
    guest.page.get_by_role("button", name="fly the path").click()
    until(lambda: session.fly.flight is not None)
    frame_after(session, lambda: guest.type_into("frame", 10))
    guest.page.get_by_text("of the weight").first.wait_for()
    air = session.fly.along(1.0)
    assert air is not None
    assert 0 < np.linalg.norm(air.drag) < air.weight
    session.fly._path.value = "/etc/passwd.yaml"
    guest.page.get_by_role("button", name="fly the path").click()
    guest.page.get_by_text("is a file").first.wait_for()


def test_a_report_adds_its_causes_and_the_gap_follows(browser: "Browser", run: Path, tmp_path: Path) -> None:
    folder = write_report(tmp_path / "report", run, where=False)
    faces = len(open_stage(run).scene.faces)  # type: ignore[union-attr]
    share = np.linspace(0, 1, faces, dtype=np.float32)
    np.savez(folder / "where.npz", face_share=share, image_share=np.eye(4, dtype=np.float32))
    viewer = Viewer(lambda: open_stage(folder), "report", port=0, folder=tmp_path)
    try:
        with visit(browser, viewer) as guest:
            session = guest.open()
            guest.page.get_by_text("Gap 1 bit").wait_for()
            guest.page.get_by_text("most of the gap").first.wait_for()
            costs = [guest.page.get_by_role("cell", name=name, exact=True) for name in ("2 ± 1", "9 ± 1 *", "2.1")]
            assert all(cell.count() == 1 for cell in costs), "what the gap costs"
            guest.control("disparity_noise  (60%)").click()
            guest.page.get_by_text("Gap 0.4 bit").wait_for()
            until(lambda: {e.id for e in session.effects.effects()} == {"disparity_noise", "fill_rate"})
            until(lambda: session.shown.sides == ("recording", "sensor"))
            guest.page.get_by_role("button", name="add all").click()
            guest.page.get_by_text("Gap 0.1 bit").wait_for()
            assert session.effects.effects() == load_profile(folder / "sensor.yaml").effects
            guest.page.get_by_role("button", name="remove all").click()
            guest.page.get_by_text("Gap 1 bit").wait_for()
            assert session.effects.effects() == load_profile("paper").effects
            assert guest.errors == []
    finally:
        viewer.stop()
