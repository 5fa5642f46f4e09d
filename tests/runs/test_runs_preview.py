import numpy as np
import pytest

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.runs import Run, RunWriter
from depthsim.runs.png import decode_png
from depthsim.runs.preview import _round_up, preview
from depthsim.runs.terminal import depth_span, terminal_picture, turbo
from depthsim.trajectory import Trajectory

CAMERA = Camera(name="small", width=64, height=36, fx=50, fy=50, cx=31.5, cy=17.5, baseline=0.05)
STREAMS = ("depth", "clean", "material", "rgb")


@pytest.fixture(scope="module", params=[STREAMS, ("depth",)])
def run(request, tmp_path_factory) -> Run:
    path = tmp_path_factory.mktemp("preview") / "run"
    poses = Trajectory(np.arange(7) / 10, np.zeros((7, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (7, 1)))
    clean = np.tile(np.linspace(1000, 8000, 64).astype(np.uint16), (36, 1))
    with RunWriter(path, CAMERA, poses, {"scene": "ramp", "tags": ["cement"]}, request.param) as writer:
        for index in range(7):
            depth = clean + np.uint16(index)
            depth[:9] = 0
            tags = np.where(clean > 3000, 255, index % 2).astype(np.uint8)
            pictures = {"depth": depth, "clean": clean, "material": tags, "rgb": tags}
            writer.write_frame(index, {stream: pictures[stream] for stream in request.param})
        writer.finish()
    return Run.open(path)


def test_the_sheet(run, tmp_path):
    preview(run, tmp_path / "sheet.png")
    sheet = decode_png(tmp_path / "sheet.png")
    rows = 5 if run.has("clean") else 1
    assert sheet.shape[1] == 1400
    assert 100 * rows < sheet.shape[0] < 200 * rows + 100
    black = (sheet == 0).all(axis=2).mean()
    assert 0.1 < black < 0.4  # a quarter of each depth is holes
    preview(run, tmp_path / "again.png")
    assert (tmp_path / "again.png").read_bytes() == (tmp_path / "sheet.png").read_bytes()
    preview(run, tmp_path / "one.png", frames=1)


def test_a_sheet_without_any_return(tmp_path):
    poses = Trajectory([0.0], np.zeros((1, 3)), [[0.0, 0.0, 0.0, 1.0]])
    with RunWriter(tmp_path / "run", CAMERA, poses, {}, ("depth", "clean")) as writer:
        nothing = np.zeros(CAMERA.shape, np.uint16)
        writer.write_frame(0, {"depth": nothing, "clean": nothing})
        writer.finish()
    preview(Run.open(tmp_path / "run"), tmp_path / "sheet.png")
    assert decode_png(tmp_path / "sheet.png").shape[1] == 1400


def test_a_sheet_that_cannot_be_written(run, tmp_path):
    with pytest.raises(InputError, match="cannot be written"):
        preview(run, tmp_path / "none" / "sheet.png", frames=1)


def test_round_up():
    assert [_round_up(value) for value in (0.7, 1, 1.1, 3, 5.1, 20, 99)] == [1, 1, 2, 5, 10, 20, 100]


def test_turbo_is_matplotlibs():
    from matplotlib import colormaps

    share = np.linspace(0, 1, 256)
    theirs = np.asarray(colormaps["turbo"](share))[:, :3] * 255
    assert np.abs(turbo(share) - theirs).max() < 7


def test_terminal_picture():
    depth = np.ones((90, 160), np.float32)
    depth[:, 80:] = 4
    depth[45:, :40] = 0
    text = terminal_picture(depth, 40)
    lines = text.plain.split("\n")
    assert [set(line) for line in lines[:-1]] == [{"▀"}] * 11
    assert [len(line) for line in lines] == [40] * 12
    assert lines[-1].startswith("1.00 m ▄") and lines[-1].endswith("▄ 4.00 m")
    near, far = ("#{:02x}{:02x}{:02x}".format(*colour) for colour in turbo(np.array([0.0, 1.0])).tolist())
    styles = [str(span.style) for span in text.spans]
    assert styles[0] == f"{near} on {near}"
    assert styles[39] == f"{far} on {far}"
    assert styles[10 * 40] == "#101010 on #101010"


@pytest.mark.parametrize("shape", [(1, 1), (3, 500), (500, 3)])
def test_terminal_picture_of_any_shape(shape):
    for depth in (np.zeros(shape, np.float32), np.full(shape, 2, np.float32)):
        lines = terminal_picture(depth, 60).plain.split("\n")
        assert {len(line) for line in lines[:-1]} == {min(60, shape[1])}


def test_depth_span():
    assert depth_span(np.zeros((4, 4))) == (1.0, 2.0)
    near, far = depth_span(np.full((4, 4), 2.0))
    assert near == 2.0 and far > near
