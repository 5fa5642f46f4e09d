"""Aligned pictures whose poses are the left imager's."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import depthsim_here

from depthsim.camera import ColorCamera
from depthsim.gap.depth.data.load import load_evidence
from depthsim.presets import preset
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.pose_reference import with_poses_of_pictures
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory
from depthsim.trajectory.tum import write_tum

SCENE = load_scene("office")


@pytest.fixture(scope="module")
def aligned(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Of the colour camera, with its own poses."""
    picture: dict[str, Any] = {"width": 106, "height": 60, "fx": 76, "fy": 76, "cx": 52, "cy": 30}
    color = ColorCamera(**picture, rotation=(0.01, -0.01, 0.005, 1.0), translation=(0.06, 0, 0))
    camera = preset("d435", 106, 60).model_copy(update={"color": color.model_dump(), "rate": 3.0}).aligned_to_color()
    folder = tmp_path_factory.mktemp("aligned") / "run"
    path = load_trajectory("tour", SCENE, camera.rate, 18)
    generate(SCENE, path, camera, load_profile("paper"), folder, streams=("depth",), seed=3, threads=1)
    return Run.open(folder)


def test_poses_of_the_left_imager_are_told_from_those_of_the_colour_camera(aligned: Run) -> None:
    assert with_poses_of_pictures(aligned, SCENE) is aligned
    left = aligned.truth.beside(aligned.camera.left_pose)
    run = replace(aligned, truth=left, trajectory=left.at(aligned.stamps))
    found = with_poses_of_pictures(run, SCENE)
    assert np.allclose(found.poses, aligned.poses, atol=1e-9)
    assert found.remarks[0].startswith(
        "the pictures are aligned to colour, and groundtruth.txt has the poses of the le"
    )


def test_a_diagnosis_takes_the_poses_of_the_left_imager_as_such(aligned: Run) -> None:
    left = aligned.truth.beside(aligned.camera.left_pose)
    run = replace(aligned, truth=left, trajectory=left.at(aligned.stamps))
    evidence, _ = load_evidence(run, SCENE, "paper")
    assert evidence.run.by_left


def test_pictures_of_the_left_imager_keep_their_poses(aligned: Run, tmp_path: Path) -> None:
    run = replace(aligned, camera=aligned.camera.left)
    assert with_poses_of_pictures(run, SCENE) is run


def test_like_takes_the_poses_of_the_left_imager_as_such(aligned: Run, tmp_path: Path) -> None:
    run = shutil.copytree(aligned.path, tmp_path / "run")
    write_tum(aligned.truth.beside(aligned.camera.left_pose), run / "groundtruth.txt")
    command = ["generate", "--like", str(run), "--out", str(tmp_path / "sim"), "--seed", "3", "--only-depth"]
    result = depthsim_here(*command)
    assert result.returncode == 0 and "the poses of the left imager" in result.stderr
    made = Run.open(tmp_path / "sim")
    assert np.allclose(made.poses, aligned.poses, atol=1e-6)
    same = [(made.depth_raw(i) == aligned.depth_raw(i)).mean() for i in range(len(made))]
    assert min(same) > 0.95  # but where a pose that was rounded moves an edge
