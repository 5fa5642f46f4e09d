"""Real recordings as the benchmarks take them: those that are there, with scenes."""

from pathlib import Path

from reports import PAPER, recorded

from benchmarks.real_sets import WITH_SCENE, real_sets


def test_what_is_not_there_is_left_out(tmp_path: Path) -> None:
    assert list(real_sets(tmp_path, tmp_path)) == []
    (tmp_path / WITH_SCENE[1]).symlink_to(recorded(PAPER))
    (run,) = real_sets(tmp_path, tmp_path)
    assert run.path.name == WITH_SCENE[1] and run.scene is not None
