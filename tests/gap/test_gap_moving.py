"""Objects in the diagnosis: as an axis, as a mask, and where they are in each frame."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from moving import CAMERA, write_scene
from typer.testing import CliRunner

from depthsim.cli import app
from depthsim.errors import InputError
from depthsim.gap.depth.data.load import load_evidence, notes_of
from depthsim.gap.depth.data.regions import region_name, split_scene
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor.effects.extrinsics import TimeOffset


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("moving")
    camera = CAMERA.model_copy(update={"depth_scale": 1e-4})
    generate(write_scene(folder), "stand", camera, "paper", folder / "run", seed=4)
    return folder / "run"


def test_an_object_is_a_cell_of_the_axis_of_objects_and_a_region(run: Path) -> None:
    evidence, _ = load_evidence(run, None, "paper", threads=1)
    number = next(n for n, axis in enumerate(evidence.axes) if axis.name == "instance")
    axis = evidence.axes[number]
    assert axis.label(np.arange(axis.size)) == "wall, parcel"
    recorded = Run.open(run)
    index = int(evidence.blocks[0][0])
    place = evidence.frames[index].places[number]
    shown = recorded.instance(index)
    assert shown is not None
    begin = int(evidence.offsets[number])
    counted = evidence.frames[index].counted
    assert len(np.unique(place)) == 2
    assert np.count_nonzero(place == place.max()) == np.count_nonzero(shown[counted] == 2)
    assert begin > 0
    scene = load_scene(run)
    region = split_scene(scene)
    own = int(region[scene.movers[0].faces[0]])
    assert (region == own).sum() == 12
    assert region_name(scene, region, own) == "parcel, which moves"


def test_a_scene_of_one_object_has_no_such_axis(run: Path) -> None:
    scene = load_scene(run)
    count, faces = scene.standing
    still = replace(
        scene, vertices=scene.vertices[:count], faces=scene.faces[:faces], face_tags=scene.face_tags[:faces],
        movers=(), instances=(),
    )  # fmt: skip
    plain = replace(Run.open(run), path=run.parent)  # where there are no pictures of objects
    plain = replace(plain, path=run.parent)
    assert not plain.has("instance")
    evidence, _ = load_evidence(plain, still, "paper", threads=1)
    assert "instance" not in [axis.name for axis in evidence.axes]


def test_the_simulation_goes_along_with_the_objects(run: Path) -> None:
    """The recording and its simulation differ as two simulations do, on the object, too; a still object would not."""
    evidence, profile = load_evidence(run, None, "paper", threads=1)
    number = next(n for n, axis in enumerate(evidence.axes) if axis.name == "instance")
    blocks = range(len(evidence.blocks))
    begin, end = int(evidence.offsets[number]), int(evidence.offsets[number + 1])

    def share(counts: np.ndarray) -> np.ndarray:
        cells = counts[:, begin:end].sum(axis=0).reshape(2, -1)[1]
        return cells / cells.sum()

    real = share(evidence.real_counts(blocks))
    same = share(evidence.simulate(profile.effects, blocks))
    late = share(evidence.simulate([*profile.effects, TimeOffset(offset=0.2)], blocks))
    assert np.abs(real - same).sum() < 0.1
    assert np.abs(real - late).sum() > 3 * np.abs(real - same).sum()


def test_a_mask_leaves_out_what_is_named(run: Path) -> None:
    recorded = Run.open(run)
    shown = recorded.instance(2)
    only, without = recorded.looking_at(["parcel"]).mask(2), recorded.looking_at(without=["parcel"]).mask(2)
    assert only is not None and without is not None
    assert np.array_equal(only, shown == 2)
    assert np.array_equal(without, shown != 2)
    assert recorded.looking_at() is recorded
    evidence, _ = load_evidence(run, None, "paper", threads=1, without_objects=["parcel"])
    assert "left out, by instance/: parcel" in notes_of(evidence)
    number = next(n for n, axis in enumerate(evidence.axes) if axis.name == "instance")
    begin, end = int(evidence.offsets[number]), int(evidence.offsets[number + 1])
    counts = evidence.real_counts(range(len(evidence.blocks)))[:, begin:end].sum(axis=0).reshape(2, -1)
    assert counts[0].sum() > 0 and counts[1].sum() == 0


def test_unknown_objects_and_runs_without_pictures_are_one_line(run: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"there is no object 'person'; the objects are wall, parcel"):
        Run.open(run).looking_at(["person"])
    generate(load_scene("wall"), "rail", CAMERA, "paper", tmp_path / "plain", frames=2)
    with pytest.raises(InputError, match="has no pictures of its objects"):
        Run.open(tmp_path / "plain").looking_at(["wall"])
    said = CliRunner().invoke(app, ["diagnose", str(run), "--object", "nobody", "--out", str(tmp_path / "report")])
    assert said.exit_code != 0
    assert not (tmp_path / "report").exists()
