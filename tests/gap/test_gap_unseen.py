"""What a recording cannot show."""

from pathlib import Path

import pytest
from recordings import make_room_run, write_room

from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.fit.unseen import in_words, unseen
from depthsim.runs import Run


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, Path]:
    """A room of cement, as it was recorded; the same room with boxes of plastic."""
    folder = tmp_path_factory.mktemp("unseen")
    text = write_room(folder / "boxes.obj").read_text()
    first = text.index("\nv ", len(text) // 2)
    (folder / "boxes.obj").write_text(text[:first] + "\nusemtl plastic" + text[first:])
    return make_room_run(folder / "run", "paper", frames=8), folder / "boxes.obj"


def test_holes_of_one_material_are_seen_where_there_are_several(room: tuple[Run, Path]) -> None:
    """By default the effect is for dark materials, and neither is dark."""
    run, boxes = room
    of_one, of_two = (unseen(load_evidence(run, scene, "paper", threads=1)[0]) for scene in (None, boxes))
    assert "material_dropout" in of_one and "material_dropout" not in of_two
    for names in (of_one, of_two):
        assert "min_range" in names  # nothing is nearer than 0.28 m
        assert not {"material_noise", "disparity_noise", "baseline_scale", "heavy_tails"} & set(names)
    without = unseen(load_evidence(run, None, "paper", threads=1)[0], ("min_range",))
    assert set(without) == set(of_one) - {"min_range"}


def test_what_is_to_be_recorded_is_said_once() -> None:
    said = in_words(("min_range", "max_range", "material_dropout"))
    assert said.startswith("this recording cannot show, at a typical strength: min_range (record ")
    assert said.count("record the same range and angle on several materials") == 1
