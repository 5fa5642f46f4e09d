"""Recordings that were decimated and scaled back to their size: tiles of one value each."""

from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from recordings import ROOM_CAMERA, room_path, write_room

from depthsim.gap import diagnose
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.data.tiles import find_tiles
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.png import encode_png
from depthsim.scenefile import load_scene
from depthsim.sensor import Profile, effect_class
from depthsim.sensor.effect import effect_ids

CAMERA = ROOM_CAMERA.model_copy(update={"width": 112, "height": 84, "fx": 63.0, "fy": 63.0, "cx": 55.5, "cy": 41.5})
BASE = Profile(name="made", effects=(effect_class("disparity_noise")(sigma=0.06), effect_class("fill_rate")(rate=0.01)))


@given(st.integers(2, 8), arrays(np.uint16, (12, 12), elements=st.integers(500, 60000), unique=True))
def test_tiles_are_found_by_their_side(side: int, values: Any) -> None:
    picture = values.repeat(side, axis=0).repeat(side, axis=1)
    assert find_tiles([picture, picture]) == side
    picture = picture.copy()
    picture[: side * 2, : side * 3] = 0  # where nothing is measured nothing is said
    assert find_tiles([picture]) == side


@given(st.integers(0, 10_000))
def test_noise_has_no_tiles_nor_has_what_is_alike(seed: int) -> None:
    assert find_tiles([np.random.default_rng(seed).integers(0, 65536, (40, 50), np.uint16)]) is None
    assert find_tiles([np.full((40, 50), 2000, np.uint16)]) is None
    assert find_tiles([]) is None


def test_what_else_there_is_is_found_beside_tiles(tmp_path: Path) -> None:
    """Means of two by two pixels, made here, of a camera whose baseline is off."""
    scene = load_scene(write_room(tmp_path / "room.obj"))
    made = Profile(name="made", effects=(*BASE.effects, effect_class("baseline_scale")(scale=1.015)))
    generate(scene, room_path(np.arange(20) / 10), CAMERA, made, tmp_path / "run", seed=3)
    run = Run.open(tmp_path / "run")
    for index, file in enumerate(run.files):
        raw = run.depth_raw(index).astype(float)
        tiles = np.where(raw > 0, raw, np.nan).reshape(42, 2, 56, 2)
        means = np.floor(np.nanmean(tiles, axis=(1, 3)) + 0.5)
        file.write_bytes(encode_png(np.nan_to_num(means).repeat(2, axis=0).repeat(2, axis=1).astype(np.uint16)))
    run = Run.open(tmp_path / "run")
    assert load_evidence(run, scene, BASE)[0].tiled == 2
    bank = {"decimation", "baseline_scale", "disparity_offset", "disparity_noise", "spatial_filter"}
    found = diagnose(run, scene=scene, sensor=BASE, without=sorted({*effect_ids()} - bank), tasks=False)
    assert {"decimation", "baseline_scale"} <= {cause.effect for cause in found.causes}
    decimation = next(cause for cause in found.causes if cause.effect == "decimation")
    assert decimation.parameters == {"factor": 2, "upscaled": 1, "nearest": 1}
    assert found.gap.closed_fraction > 0.9
