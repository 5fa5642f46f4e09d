"""Objects in the viewer: where they are at each frame, and out of sight when they are hidden."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from browser import WHY_NOT, frame_after, until, visit
from moving import CAMERA, write_scene

from benchmarks.chromium import chromium
from depthsim.materials import load_materials
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from viewer import Viewer, open_stage
from viewer.controls.handles import put
from viewer.measure import recorded
from viewer.meshes import by_material


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("moving")
    generate(write_scene(folder), "stand", CAMERA, "clean", folder / "run", frames=12)
    yield folder / "run"


def test_groups_of_faces_are_those_of_objects(run: Path) -> None:
    scene = load_scene(run)
    groups = {group.name: group for group in by_material(scene, load_materials())}
    assert set(groups) == {"wall/cement", "parcel/plastic"}
    assert (groups["wall/cement"].mover, groups["parcel/plastic"].mover) == (None, 0)
    assert groups["parcel/plastic"].vertices.max() == pytest.approx(0.3)  # in its own frame


def test_a_hidden_object_is_not_in_the_cloud(run: Path) -> None:
    stage = open_stage(run)
    assert stage.objects == {1: "wall", 2: "parcel"}
    shot = recorded(stage, 3)
    assert shot.instance is not None
    left = shot.without(frozenset([2]))
    assert np.array_equal(left.depth_raw > 0, shot.instance == 1)
    assert shot.without(frozenset()) is shot


@pytest.mark.skipif(bool(WHY_NOT), reason=WHY_NOT or "there is a browser")
def test_the_page_moves_and_hides_objects(run: Path) -> None:
    stage = open_stage(run)
    viewer = Viewer(lambda: stage, "test", port=0, folder=run.parent / "saved")
    try:
        with chromium() as browser, visit(browser, viewer) as guest:
            session = guest.open()
            scenery = session.screen.scenery
            handles = dict(zip([g.name for g in scenery._of["a"]], scenery._meshes["a"], strict=True))
            parcel = handles["parcel/plastic"]
            assert np.allclose(parcel.position, [2, -0.5, 0], atol=1e-6)
            frame_after(session, lambda: guest.type_into("frame", 6))
            until(lambda: np.allclose(parcel.position, [2, -0.5 + 2 * 6 / 30, 0], atol=1e-5))
            points = session.shown.points
            frame_after(session, lambda: put(session.look.objects[2], False))
            until(lambda: not parcel.visible)
            assert handles["wall/cement"].visible
            assert session.shown.points < points
            assert guest.errors == []
    finally:
        viewer.stop()
