import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.runs import Run, RunWriter
from depthsim.runs.layout import decode_normals, encode_normals
from depthsim.runs.png import encode_png
from depthsim.trajectory import Trajectory, write_tum

FLOOR = Path(__file__).parents[3] / "shared" / "data" / "d435_floor"
CAMERA = Camera(name="small", width=6, height=4, fx=5, fy=5, cx=2.5, cy=1.5, baseline=0.05, rate=10)
STAMPS = np.array([0.0, 0.1, 0.2, 0.4])
DEPTH = np.arange(24, dtype=np.uint16).reshape(4, 6) * 100


def path_of(stamps: np.ndarray) -> Trajectory:
    """Along x at 1 m/s, turning about z at 1 rad/s."""
    zero = np.zeros_like(stamps)
    quaternions = np.stack([zero, zero, np.sin(stamps / 2), np.cos(stamps / 2)], axis=1)
    return Trajectory(stamps, np.stack([stamps, zero, zero + 1], axis=1), quaternions)


def frame(index: int) -> dict[str, np.ndarray]:
    depth = DEPTH + np.uint16(index)
    depth[0, 0], depth[0, 1] = 0, 65535
    normals = np.zeros((4, 6, 3), np.float32)
    normals[1:, :, 2] = -1
    tags = np.full((4, 6), 255, np.uint8)
    tags[1:] = index % 2
    rgb = np.full((4, 6), 40 * index, np.uint8)
    return {"depth": depth, "clean": DEPTH, "material": tags, "normal": normals, "rgb": rgb}


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    path = tmp_path_factory.mktemp("runs") / "whole"
    streams = ("depth", "clean", "material", "normal", "rgb")
    with RunWriter(path, CAMERA, path_of(STAMPS), {"scene": "box", "tags": ["cement", "plastic"]}, streams) as writer:
        for index in writer.missing():
            writer.write_frame(index, frame(index))
        writer.finish()
    return path


@pytest.fixture
def run(whole, tmp_path) -> Path:
    """A copy that a test may break."""
    return Path(shutil.copytree(whole, tmp_path / "run"))


def test_everything_comes_back(whole):
    run = Run.open(whole)
    assert len(run) == 4
    assert run.camera == CAMERA
    assert run.meta["scene"] == "box"
    assert run.tags == ("cement", "plastic")
    assert run.scene is None
    np.testing.assert_array_equal(run.stamps, STAMPS)
    np.testing.assert_array_equal(run.poses, path_of(STAMPS).matrices())
    for index in range(4):
        wanted = frame(index)
        np.testing.assert_array_equal(run.depth_raw(index), wanted["depth"])
        np.testing.assert_array_equal(run.material(index), wanted["material"])
        np.testing.assert_array_equal(run.rgb(index), wanted["rgb"])
        np.testing.assert_array_equal(run.normal(index), wanted["normal"])
        np.testing.assert_allclose(run.clean(index), wanted["clean"] / 1000, atol=1e-6)
        metres = np.where(wanted["depth"] == 65535, 0, wanted["depth"]) / 1000
        np.testing.assert_allclose(run.depth(index), metres, rtol=1e-7)
        np.testing.assert_array_equal(run.saturated(index), wanted["depth"] == 65535)
        assert run.mask(index) is None
    assert run.depth(0).dtype == np.float32
    assert run.has("clean") and run.has("rgb") and not run.has("mask")


def test_a_normal_is_kept_within_half_a_degree():
    normals = np.random.default_rng(0).standard_normal((200, 200, 3)).astype(np.float32)
    normals /= np.linalg.norm(normals, axis=2, keepdims=True)
    back = decode_normals(encode_normals(normals))
    assert np.degrees(np.arccos(np.clip((normals * back).sum(2), -1, 1))).max() < 0.4
    np.testing.assert_allclose(np.linalg.norm(back, axis=2), 1, atol=1e-6)


def test_masks_of_any_kind(run):
    (run / "mask").mkdir()
    wanted = DEPTH > 900
    kinds = [wanted.astype(np.uint8), wanted * np.uint16(256), np.dstack([wanted * np.uint8(9)] * 3)]
    for stamp, mask in zip(STAMPS, kinds, strict=False):
        (run / "mask" / f"{stamp:.6f}.png").write_bytes(encode_png(mask))
    Image.fromarray(wanted).save(run / "mask" / "0.400000.png")
    opened = Run.open(run)
    for index in range(4):
        assert opened.mask(index).dtype == bool
        np.testing.assert_array_equal(opened.mask(index), wanted)


def test_a_denser_ground_truth_is_interpolated(run):
    write_tum(path_of(np.arange(-0.05, 0.5, 0.07)), run / "groundtruth.txt")
    np.testing.assert_allclose(Run.open(run).poses, path_of(STAMPS).matrices(), atol=1e-12)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("\n", "\r\n"),
        ("0.100000 ", "1e-1\t"),
        ("0.100000 ", "  .1   "),
        ("0.200000 ", "# a comment\n\n0.2000000000 "),
        ("# timestamp filename\n", ""),
        ("# timestamp", "\ufeff# timestamp"),
    ],
)
def test_lists_as_others_write_them(run, old, new):
    for name in ("depth.txt", "groundtruth.txt"):
        with (run / name).open("r+", newline="") as file:
            text = file.read()
            file.seek(0)
            file.write(text.replace(old, new))
            file.truncate()
    opened = Run.open(run)
    np.testing.assert_array_equal(opened.stamps, STAMPS)
    np.testing.assert_array_equal(opened.poses, path_of(STAMPS).matrices())
    assert opened.depth_raw(3)[1, 1] == DEPTH[1, 1] + 3


def test_intensity_is_the_nearest_in_time(run):
    names = [path.name for path in sorted((run / "rgb").iterdir())]
    stamps = [-0.06, 0.04, 0.12, 0.21]  # rate 10: up to 0.05 s away
    (run / "rgb.txt").write_text("".join(f"{s} rgb/{name}\n" for s, name in zip(stamps, names, strict=True)))
    opened = Run.open(run)
    assert [file and file.name for file in opened.rgb_files] == [names[1], names[2], names[3], None]
    assert opened.rgb(3) is None
    assert not opened.has("rgb")
    (run / "rgb.txt").write_text(f"0.11 rgb/{names[0]}\n")
    assert [file is not None for file in Run.open(run).rgb_files] == [False, True, False, False]
    (run / "rgb.txt").write_text("# nothing yet\n")
    assert not Run.open(run).has("rgb")


def test_a_scene_in_the_folder(run):
    (run / "scene.obj").touch()
    assert Run.open(run).scene == run / "scene.obj"
    (run / "scene.yaml").touch()
    assert Run.open(run).scene == run / "scene.yaml"


def test_without_a_record(run):
    (run / "run.yaml").unlink()
    opened = Run.open(run)
    assert opened.meta == {}
    assert opened.tags == ()


def test_the_real_recording():
    if not FLOOR.is_dir():
        pytest.skip("shared/data/d435_floor is not beside the repository")
    run = Run.open(FLOOR)
    truth = np.loadtxt(FLOOR / "groundtruth.txt")
    assert len(run) == 120
    assert run.scene == FLOOR / "scene.obj"
    np.testing.assert_array_equal(run.stamps, truth[:, 0])
    np.testing.assert_array_equal(run.poses[:, :3, 3], truth[:, 1:4])
    np.testing.assert_allclose(np.linalg.det(run.poses[:, :3, :3]), 1, atol=1e-9)
    for index in (0, 77, 119):
        name = run.files[index].name
        raw = np.asarray(Image.open(FLOOR / "depth" / name))
        np.testing.assert_array_equal(run.depth_raw(index), raw)
        np.testing.assert_array_equal(run.mask(index), np.asarray(Image.open(FLOOR / "mask" / name)) != 0)
        assert run.depth(index).max() < 65.5
        assert (run.depth(index) == 0).sum() == ((raw == 0) | (raw == 65535)).sum()
    assert run.clean(0) is None and run.material(0) is None and run.normal(0) is None and run.rgb(0) is None


def replace(name: str, old: str, new: str) -> Callable[[Path], None]:
    def change(run: Path) -> None:
        text = (run / name).read_text()
        assert old in text
        (run / name).write_text(text.replace(old, new))

    return change


def remove(*names: str) -> Callable[[Path], None]:
    def change(run: Path) -> None:
        for name in names:
            (run / name).unlink()

    return change


def write(name: str, data: bytes) -> Callable[[Path], None]:
    def change(run: Path) -> None:
        (run / name).parent.mkdir(exist_ok=True)
        (run / name).write_bytes(data)

    return change


def link_outside(run: Path) -> None:
    (run.parent / "secret.png").write_bytes(encode_png(DEPTH))
    (run / "depth" / "0.100000.png").unlink()
    (run / "depth" / "0.100000.png").symlink_to(run.parent / "secret.png")


def picture(shape: tuple[int, ...], dtype: type = np.uint16) -> bytes:
    return encode_png(np.ones(shape, dtype))


FIRST = "depth/0.000000.png"
BROKEN: list[tuple[Callable[[Path], object], str, str]] = [
    (shutil.rmtree, "", "no such folder"),
    (lambda run: (shutil.rmtree(run), run.touch()), "", "is a file, not a folder"),
    (lambda run: [shutil.rmtree(run), run.mkdir()], "depth.txt", "is missing"),
    (remove("camera.yaml"), "camera.yaml", "is missing"),
    (remove("groundtruth.txt"), "groundtruth.txt", "is missing"),
    (remove("depth.txt", "run.yaml"), "depth.txt", "is missing"),
    (remove("depth.txt"), "", "unfinished: 4 of 4 frames; the same generate command finishes it"),
    (remove("depth.txt", FIRST, "depth/0.400000.png"), "", "unfinished: 2 of 4 frames"),
    (write("run.yaml", b"- a\n- b\n"), "run.yaml", "holds a list"),
    (write("run.yaml", b"{"), "run.yaml", "is not YAML"),
    (replace("camera.yaml", "fx: 5.0\n", ""), "camera.yaml", "fx: field required"),
    (replace("camera.yaml", "width: 6", "width: -6"), "camera.yaml", "width: input should be greater than 0"),
    (write("depth.txt", b"# timestamp filename\n"), "depth.txt", "names no frame"),
    (write("depth.txt", b"\xff\xfe\x00"), "depth.txt", "is not UTF-8"),
    (remove("depth/0.200000.png"), "depth.txt", "line 4: names depth/0.200000.png, which is not there"),
    (replace("depth.txt", FIRST, "../run/" + FIRST), "depth.txt", "line 2: .*leaves the folder"),
    (replace("depth.txt", FIRST, "/etc/hostname"), "depth.txt", "line 2: .*leaves the folder"),
    (replace("depth.txt", FIRST, "depth"), "depth.txt", "line 2: names depth, which is not there"),
    (replace("depth.txt", FIRST, "dep\0th"), "depth.txt", "line 2: .*leaves the folder"),
    (link_outside, "depth.txt", "line 3: .*leaves the folder"),
    (replace("depth.txt", FIRST, ""), "depth.txt", "line 2: has 1 columns, not 2"),
    (replace("depth.txt", FIRST, FIRST + " extra"), "depth.txt", "line 2: has 3 columns, not 2"),
    (replace("depth.txt", "0.100000 ", "0.100000,"), "depth.txt", "line 3: has 1 columns, not 2"),
    (replace("depth.txt", "0.100000 ", "noon "), "depth.txt", "line 3: 'noon' is no time stamp"),
    (replace("depth.txt", "0.100000 ", "nan "), "depth.txt", "line 3: 'nan' is no time stamp"),
    (replace("depth.txt", "0.100000 ", "1_0 "), "depth.txt", "line 3: '1_0' is no time stamp"),
    (replace("depth.txt", "0.200000 ", "0.05 "), "depth.txt", "line 4: stamp 0.05.* is not after"),
    (replace("depth.txt", "0.200000 ", "0.1 "), "depth.txt", "line 4: stamp 0.1.* is not after"),
    (replace("depth.txt", "0.400000 ", "0.5 "), "depth.txt", r"line 5: stamp 0.500000 is outside groundtruth.txt"),
    (replace("depth.txt", "0.000000 ", "-0.5 "), "depth.txt", r"line 2: stamp -0.500000 is outside groundtruth.txt"),
    (write("groundtruth.txt", b""), "groundtruth.txt", "holds no pose"),
    (replace("groundtruth.txt", " 0.0 ", " x "), "groundtruth.txt", "line 2: .*not a number"),
    (write("mask/0.000000.png", picture((4, 6))), "mask", "0.100000.png: no such file"),
    (remove("clean/0.100000.png"), "clean", "0.100000.png: no such file, .*add it or remove clean/"),
    (remove("rgb/0.100000.png"), "rgb.txt", "line 3: names rgb/0.100000.png, which is not there"),
    (write(FIRST, b""), FIRST, "is empty"),
    (write(FIRST, b"P5 6 4 255"), FIRST, "is not a PNG"),
    (write(FIRST, picture((4, 6))[:-20]), FIRST, "is a damaged PNG"),
    (write(FIRST, picture((6, 4))), FIRST, "is 4x6, the camera is 6x4"),
    (write(FIRST, picture((4, 6), np.uint8)), FIRST, "is 8-bit grey, not 16-bit grey"),
    (write(FIRST, picture((4, 6, 3))), FIRST, "is a 16-bit PNG in colour"),
    (write("clean/0.000000.png", picture((4, 6), np.uint8)), "clean/0.000000.png", "not 16-bit grey"),
    (write("material/0.000000.png", picture((4, 6))), "material/0.000000.png", "is 16-bit grey, not 8-bit grey"),
    (write("normal/0.000000.png", picture((4, 6), np.uint8)), "normal/0.000000.png", "not 8-bit RGB"),
    (write("rgb/0.000000.png", picture((4, 6))), "rgb/0.000000.png", "is 16-bit grey, not 8-bit"),
    (write("rgb/0.000000.png", picture((5, 6), np.uint8)), "rgb/0.000000.png", "is 6x5, the camera is 6x4"),
]


@pytest.mark.parametrize(("change", "file", "problem"), BROKEN)
def test_a_broken_run_is_one_clear_line(run, change, file, problem):
    change(run)
    with pytest.raises(InputError) as error:
        opened = Run.open(run)
        for read in (opened.depth, opened.clean, opened.material, opened.normal, opened.rgb, opened.mask):
            read(0)
    line = str(error.value)
    assert line.startswith(str(run / file))
    assert re.search(problem, line)
    assert "\n" not in line
    assert error.value.fix
