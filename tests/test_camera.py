"""Rays of the pinhole and the Brown-Conrady camera, and broken camera.yaml files."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import example, given, settings
from hypothesis import strategies as st

from depthsim.camera import Camera, Window, _jacobian, distort, read_camera, undistort
from depthsim.errors import InputError

YAML = {"width": 64, "height": 48, "fx": 50.0, "fy": 52.0, "cx": 31.5, "cy": 23.5, "baseline": 0.05}


def brown_conrady(*distortion: float, **keys: float) -> Camera:
    return Camera.model_validate({**YAML, "model": "brown_conrady", "distortion": distortion, **keys})


def pixels(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    v, u = np.mgrid[: camera.height, : camera.width].astype(float)
    return (u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy


def test_pinhole_rays_are_exact() -> None:
    camera = Camera.model_validate(YAML)
    x, y = pixels(camera)
    assert camera.rays.shape == (2, 48, 64)
    assert camera.rays.dtype == np.float32
    assert np.array_equal(camera.rays, np.stack([x, y]).astype(np.float32))


COEFFICIENTS = st.tuples(
    st.floats(-0.07, 0.25),
    st.floats(-0.02, 0.1),
    st.floats(-2e-3, 2e-3),
    st.floats(-2e-3, 2e-3),
    st.floats(-0.02, 0.05),
)


@given(COEFFICIENTS)
@settings(max_examples=50)
def test_distortion_is_undone(k: tuple[float, ...]) -> None:
    camera = brown_conrady(*k)
    xd, yd = pixels(camera)
    x, y = undistort(xd, yd, k)
    again = distort(x, y, k)
    assert np.abs(again[0] - xd).max() * camera.fx < 1e-6
    assert np.abs(again[1] - yd).max() * camera.fy < 1e-6
    assert np.allclose(camera.rays, np.stack([x, y]), atol=1e-6)


def test_a_kinect_of_the_tum_dataset_is_undone() -> None:
    k = (0.262383, -0.953104, -0.005358, 0.002628, 1.163314)  # freiburg1_rgb
    camera = brown_conrady(*k, width=640, height=480, fx=517.3, fy=516.5, cx=318.6, cy=255.3)
    xd, yd = pixels(camera)
    again = distort(*undistort(xd, yd, k), k)
    assert np.abs(np.subtract(again, (xd, yd))).max() * camera.fx < 1e-6


def test_newton_keeps_to_the_branch_of_the_axis() -> None:
    # From the distorted corner alone, Newton's method finds another root or none; the radial function is monotonic.
    k = (-0.29, -0.98, 0.0, 0.0, 0.86)
    radius = np.linspace(0, 1.1, 1001)
    assert (np.diff(distort(radius, 0 * radius, k)[0]) > 0).all()
    x, y = undistort(*distort(0.8 * radius, 0.6 * radius, k), k)
    assert np.allclose(x, 0.8 * radius, atol=1e-6)
    assert np.allclose(y, 0.6 * radius, atol=1e-6)


def test_the_jacobian_is_the_derivative() -> None:
    k, step = (0.3, -0.2, 0.01, -0.02, 0.1), 1e-6
    x, y = np.random.default_rng(0).uniform(-1, 1, (2, 50))
    dx = np.subtract(distort(x + step, y, k), distort(x - step, y, k)) / 2 / step
    dy = np.subtract(distort(x, y + step, k), distort(x, y - step, k)) / 2 / step
    assert np.allclose(_jacobian(x, y, k), [dx[0], dx[1], dy[1]], atol=1e-8)
    assert np.allclose(dx[1], dy[0], atol=1e-8)


@given(COEFFICIENTS)
@settings(max_examples=25)
def test_opencv_agrees(k: tuple[float, ...]) -> None:
    cv2 = pytest.importorskip("cv2")
    camera = brown_conrady(*k)
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    v, u = np.mgrid[: camera.height, : camera.width].astype(float)
    points = np.stack([u, v], axis=-1).reshape(-1, 1, 2)
    criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 200, 1e-12)
    # OpenCV 5 takes the number of iterations in undistortPoints, OpenCV 4 in a function of its own.
    undistort_points = getattr(cv2, "undistortPointsIter", cv2.undistortPoints)
    theirs = undistort_points(points, matrix, np.array(k), R=None, P=None, criteria=criteria).reshape(48, 64, 2)
    assert np.allclose(camera.rays, np.moveaxis(theirs, -1, 0), atol=1e-6)


def test_opencv_projects_the_rays_back_to_the_pixels() -> None:
    cv2 = pytest.importorskip("cv2")
    k = (0.1, -0.02, 0.001, -0.002, 0.01)
    camera = brown_conrady(*k)
    matrix = np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]])
    points = np.stack([*undistort(*pixels(camera), k), np.ones(camera.shape)], axis=-1).reshape(-1, 3)
    seen = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(k))[0].reshape(48, 64, 2)
    v, u = np.mgrid[: camera.height, : camera.width]
    assert np.abs(seen - np.stack([u, v], axis=-1)).max() < 1e-6


@pytest.mark.parametrize("k1", [-0.35, -1.0, -20.0])
def test_a_distortion_that_folds_over_is_refused(k1: float) -> None:
    with pytest.raises(ValueError, match=r"no ray is bent to pixel \(0, 0\): the distortion folds over"):
        brown_conrady(k1, 0, 0, 0, 0)


def test_folding_outside_the_image_is_no_matter() -> None:
    # x (1 - 0.35 x²) folds over at x = 0.98, y = 0.65: beyond the edge of a longer lens.
    camera = brown_conrady(-0.35, 0, 0, 0, 0, fx=100.0, fy=100.0)
    assert np.isfinite(camera.rays).all()


@given(st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-0.2, 0.2), st.floats(-0.2, 0.2), st.floats(-3, 3)))
@example((0.0, -1.1724945288459785, 0.0, 0.0, 0.7844267116548647))  # nearly folds over, inside the image
@settings(max_examples=100)
def test_any_distortion_is_undone_or_refused(k: tuple[float, ...]) -> None:
    try:
        camera = brown_conrady(*k)
    except ValueError:
        return
    x, y = undistort(*pixels(camera), k)
    assert np.isfinite(camera.rays).all()
    # One branch: a step to the right in the image is a step to the right of the ray, and so downwards.
    assert (np.diff(x, axis=1) > 0).all()
    assert (np.diff(y, axis=0) > 0).all()


@given(st.floats(10, 1000), st.integers(1, 4000), st.sampled_from([0.0, 0.01]), st.sampled_from([0.001, 0.0001]))
def test_a_camera_is_read_as_written(fx: float, width: int, k1: float, scale: float) -> None:
    camera = Camera.model_validate({**YAML, "fx": fx, "width": width, "depth_scale": scale})
    if k1:
        camera = brown_conrady(k1, 0, 0, 0, 0, fx=fx)
    assert Camera.model_validate(yaml.safe_load(camera.to_yaml())) == camera


GOOD = "width: 64\nheight: 48\nfx: 50\nfy: 50\ncx: 31.5\ncy: 23.5\nbaseline: 0.05\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "camera.yaml: is empty; write a camera.yaml as `key: value` lines"),
        ("- 1\n", "camera.yaml: holds a list at its top, not a mapping"),
        ("width: [\n", "camera.yaml: line 2: is not YAML"),
        (GOOD + "fx: 51\n", "camera.yaml: line 8: is not YAML (key 'fx' twice)"),
        (GOOD.replace("fy: 50\n", ""), "camera.yaml: fy: field required; the keys are model, name, width, height, fx"),
        (GOOD + "focus: 1\n", "camera.yaml: focus: extra inputs are not permitted (it is 1); the keys are model"),
        (GOOD.replace("fx: 50", "fx: .nan"), "camera.yaml: fx: input should be a finite number"),
        (GOOD.replace("fx: 50", "fx: -50"), "camera.yaml: fx: input should be greater than 0 (it is -50)"),
        (GOOD.replace("width: 64", "width: 64.5"), "camera.yaml: width: input should be a valid integer"),
        (GOOD.replace("height: 48", "height: 0"), "camera.yaml: height: input should be greater than 0 (it is 0)"),
        (GOOD.replace("baseline: 0.05", "baseline: 0"), "camera.yaml: baseline: input should be greater than 0"),
        (GOOD + "depth_scale: inf\n", "camera.yaml: depth_scale: input should be a finite number"),
        (GOOD + "model: fisheye\n", "camera.yaml: model: input should be 'pinhole' or 'brown_conrady'"),
        (GOOD + "distortion: [0.1, 0, 0, 0, 0]\n", "camera.yaml: distortion is given but model is pinhole"),
        (GOOD + "model: brown_conrady\ndistortion: [0.1, 0]\n", "camera.yaml: distortion.2: field required"),
        (
            GOOD + "model: brown_conrady\ndistortion: [-2, 0, 0, 0, 0]\n",
            "camera.yaml: no ray is bent to pixel (0, 0): the distortion folds over inside the image",
        ),
    ],
)
def test_broken_files_have_one_line(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "camera.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as error:
        read_camera(path)
    line = str(error.value)
    assert "\n" not in line
    assert words in line


def test_a_missing_file_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file; give the path of a camera"):
        read_camera(tmp_path / "camera.yaml")


def test_equal_cameras_are_equal_after_their_rays_were_made() -> None:
    a, b = (Camera(width=5, height=4, fx=3, fy=3, cx=2, cy=1.5, baseline=0.05) for _ in range(2))
    assert a.rays.shape == b.rays.shape == (2, 4, 5)
    assert a == b
    assert hash(a) == hash(b)
    assert a != a.model_copy(update={"fx": 4.0})


def test_a_copy_of_another_size_has_rays_of_its_own() -> None:
    camera = Camera(width=5, height=4, fx=3, fy=3, cx=2, cy=1.5, baseline=0.05)
    assert camera.rays.shape == (2, 4, 5)
    assert camera.model_copy(update={"width": 7}).rays.shape == (2, 4, 7)


def test_a_window_has_the_rays_of_its_rows() -> None:
    whole = Camera(
        model="brown_conrady", width=60, height=41, fx=50, fy=51, cx=30.2, cy=19.7, baseline=0.05,
        distortion=(0.02, -0.01, 0.001, -0.002, 0.0),
    )  # fmt: skip
    some = np.r_[3:9, 30:41]
    window = whole.window(some)
    np.testing.assert_array_equal(window.rays, whole.rays[:, some])
    np.testing.assert_array_equal(window.rows, some)
    assert (window.whole, window.shape, window.focal_baseline) == (whole, (17, 60), 2.5)
    assert whole.window(np.arange(41)) is whole and whole.whole is whole
    assert window == whole.window(some) != whole.window(some - 1)
    assert window != window.model_copy() != whole, "a camera of that size is no part of another"
    for rows in ([-1, 0], [40, 41], [], [3, 3], [5, 4]):
        with pytest.raises(ValueError, match="must be some of 41"):
            Window(whole, np.array(rows))
