"""librealsense's filters: each against the published algorithm in plain NumPy, and against pyrealsense2 itself."""

import ctypes
import threading
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage
from shapes import MATERIALS, as_scene, box, camera, wall

from depthsim.camera import Camera
from depthsim.gap.depth.data.tiles import find_tiles
from depthsim.gap.depth.fit.candidates import candidates
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.sensor import Effect, Sensor, load_profile
from depthsim.sensor.effect import Setting
from depthsim.sensor.effects.align import AlignToColor
from depthsim.sensor.effects.decimation import Decimation
from depthsim.sensor.effects.filter import SpatialFilter
from depthsim.sensor.effects.hole_filling import HoleFilling
from depthsim.sensor.effects.noise import DisparityNoise
from depthsim.sensor.effects.temporal import TemporalFilter
from depthsim.sensor.effects.threshold import ThresholdFilter
from depthsim.sensor.motion import Motion
from depthsim.sensor.pipeline import camera_for, measuring_camera, stored_camera
from depthsim.trajectory import Trajectory

Raw = NDArray[np.uint16]
Floats = NDArray[np.float32]

# Units and f·b are powers of two, so that not one bit depends on what disparity and depth are counted in.
CAMERA = Camera(width=54, height=38, fx=64, fy=64, cx=26.5, cy=18.5, baseline=1 / 16, depth_scale=2**-10)
FACTOR = np.float32(CAMERA.focal_baseline * 32 / CAMERA.depth_scale)
"""Disparity in steps of 1/32 px, times depth in units."""


@cache
def frames(count: int = 14) -> Raw:
    """(count, height, width): a slope moves before a wall, with noise of 3 steps and holes that come and go."""
    rng = np.random.default_rng(5)
    v, u = np.mgrid[: CAMERA.height, : CAMERA.width]
    made = []
    for k in range(count):
        near = (abs(u - 20 - k) < 9) & (abs(v - 18) < 11)
        steps = np.where(near, 150 + 2 * v, 50 + 0.3 * u) + rng.normal(0, 3, v.shape)
        raw = np.rint(FACTOR / steps).astype(np.uint16)
        raw[rng.random(v.shape) < 0.25] = 0
        raw[:, : 8 + k % 3] = 0
        made.append(raw)
    return np.stack(made)


def filtered(*effects: Effect, given: Raw | None = None) -> Raw:
    """What the effects make of frames that follow each other."""
    raw = frames() if given is None else given
    depth = raw.astype(np.float32) * np.float32(CAMERA.depth_scale)
    return Sensor(camera=CAMERA, profile=effects).apply(depth).depth_raw


def to_disparity(raw: Raw, factor: np.float32 = FACTOR) -> Floats:
    return np.divide(factor, raw, out=np.zeros(raw.shape, np.float32), where=raw > 0, dtype=np.float32)


def to_raw(steps: Floats, factor: np.float32 = FACTOR) -> Raw:
    depth = np.divide(factor, steps, out=np.zeros_like(steps), where=steps > 0, dtype=np.float32)
    return (depth + np.float32(0.5)).astype(np.uint16)


def decimated(raw: Raw, factor: int) -> Raw:
    height, width = (size // factor for size in raw.shape[1:])
    out = np.zeros((len(raw), -(-height // 4) * 4, -(-width // 4) * 4), np.uint16)
    for k, v, u in np.ndindex(len(raw), height, width):
        block = np.sort(raw[k, v * factor : (v + 1) * factor, u * factor : (u + 1) * factor], axis=None)
        block = block[block > 0]
        if block.size:
            middle = block[(block.size - 1) // 2]
            out[k, v, u] = middle if factor < 4 else int(block.astype(int).sum()) // block.size
    return out


def smoothed(steps: Floats, alpha: float, delta: float, iterations: int) -> Floats:
    """Of one frame; Gastal and Oliveira's recursive filter, rows there and back, columns there and back."""
    out, a = steps.copy(), np.float32(alpha)
    for _ in range(iterations):
        for lines in (out.T, out.T[::-1], out, out[::-1]):
            given = lines.copy()
            for k in range(1, len(lines)):
                same = (given[k] > 0) & (given[k - 1] > 0) & (np.abs(given[k] - given[k - 1]) < np.float32(delta))
                lines[k] = np.where(same, a * given[k] + (np.float32(1) - a) * lines[k - 1], given[k])
    return out


RULES = [(9, 8), (8, 8), (2, 3), (2, 4), (2, 8), (1, 2), (1, 5), (1, 8), (0, 8)]


def averaged(steps: Floats, alpha: float, delta: float, persistence: int) -> Floats:
    """(frames, height, width)."""
    out, a, (least, of) = steps.copy(), np.float32(alpha), RULES[persistence]
    state, had = np.zeros_like(steps[0]), np.zeros((8, *steps[0].shape), bool)
    for k, now in enumerate(steps):
        there, known = now > 0, state > 0
        same = there & known & (np.abs(now - state) < np.float32(delta))
        fill = ~there & known & (had[:of].sum(axis=0) >= least)
        out[k] = np.where(same, a * now + (np.float32(1) - a) * state, np.where(fill, state, now))
        had[:, there & ~same] = False
        had = np.concatenate([there[None], had[:7]])
        state = np.where(there, out[k], state)
    return out


def filled(raw: Raw, mode: int) -> Raw:
    """Of one frame."""
    out = raw.copy()
    height, width = out.shape
    for v in range(height) if mode == 0 else range(1, height - 1):
        for u in range(1, width):
            if out[v, u]:
                continue
            if mode == 0:
                out[v, u] = out[v, u - 1]
                continue
            around = [out[y, x] for y, x in ((v - 1, u), (v - 1, u - 1), (v, u - 1), (v + 1, u - 1), (v + 1, u))]
            if mode == 1:
                out[v, u] = max(around)
            elif around[0]:
                out[v, u] = min(depth for depth in around if depth)
    return out


def each(what: Callable[..., Any], pictures: Any, *arguments: Any) -> Any:
    return np.stack([what(picture, *arguments) for picture in pictures])


@pytest.mark.parametrize("factor", [2, 3, 4, 5, 8])
def test_decimation(factor: int) -> None:
    np.testing.assert_array_equal(filtered(Decimation(factor=factor)), decimated(frames(), factor))


@pytest.mark.parametrize("factor", [2, 3, 4])
def test_tiles_are_the_pixels_of_the_smaller_picture(factor: int) -> None:
    small = filtered(Decimation(factor=factor))
    tiles = filtered(Decimation(factor=factor, upscaled=1))[:, ::factor, ::factor]
    down, across = (size // factor for size in frames().shape[1:])
    np.testing.assert_array_equal(tiles[:, :down, :across], small[:, :down, :across])


@pytest.mark.parametrize("factor", [2, 3, 4])
def test_a_decimated_picture_is_scaled_back_to_its_size(factor: int) -> None:
    """Tiles of the mean of their depths, or of the median, each by NumPy's own."""
    found, given = filtered(Decimation(factor=factor, upscaled=1, nearest=1)), frames()
    assert found.shape == given.shape
    down, across = (size // factor for size in given.shape[1:])
    whole = (slice(None), slice(down * factor), slice(across * factor))
    tiles = given[whole].reshape(-1, down, factor, across, factor).swapaxes(2, 3).reshape(-1, down, across, factor**2)
    depths = np.ma.masked_equal(tiles, 0)
    middle = np.ma.median(depths, axis=3) if factor < 4 else depths.mean(axis=3)
    wanted = np.floor(middle.filled(0) + 0.5).repeat(factor, axis=1).repeat(factor, axis=2)
    assert np.abs(found[whole] - wanted).max() <= (1 if factor == 2 else 0)  # halves, in float32
    np.testing.assert_array_equal(found[:, down * factor :], given[:, down * factor :])
    assert find_tiles(found) == factor and find_tiles(given) is None


def test_threshold() -> None:
    wanted = np.where((frames() >= 1200) & (frames() <= 2500), frames(), 0)
    effect = ThresholdFilter(nearest=1200 / 1024, farthest=2500 / 1024)
    np.testing.assert_array_equal(filtered(effect), wanted)
    assert 0.1 < (wanted > 0).mean() < 0.9 * (frames() > 0).mean()


def test_there_and_back_through_disparity() -> None:
    np.testing.assert_array_equal(to_raw(to_disparity(frames())), frames())


@pytest.mark.parametrize(("alpha", "delta", "iterations"), [(0.5, 20, 2), (0.25, 5, 1), (0.8, 50, 5)])
def test_spatial(alpha: float, delta: int, iterations: int) -> None:
    wanted = to_raw(each(smoothed, to_disparity(frames()), alpha, delta, iterations))
    found = filtered(SpatialFilter(alpha=alpha, delta=delta / 32, iterations=iterations))
    np.testing.assert_array_equal(found, wanted)


@pytest.mark.parametrize("persistence", range(9))
def test_temporal(persistence: int) -> None:
    alpha = 0.2 if persistence in (0, 8) else 0.4
    wanted = to_raw(averaged(to_disparity(frames()), alpha, 20, persistence))
    found = filtered(TemporalFilter(alpha=alpha, persistence=persistence))
    whole = TemporalFilter(alpha=alpha).looks_back + 1  # later frames leave out the first ones
    np.testing.assert_array_equal(found[:whole], wanted[:whole])
    off = np.abs(to_disparity(found[whole:]) - to_disparity(wanted[whole:]))
    assert whole > 14 or 0 < np.percentile(off, 99) < 0.6  # steps of 1/32 px, where the noise is 3


@pytest.mark.parametrize("persistence", [0, 3])
def test_temporal_on_depth(persistence: int) -> None:
    """Without the transform to disparity, as librealsense's filter is used as well: steps are those of depth."""
    unit = np.float32(CAMERA.depth_scale)
    wanted = averaged(frames().astype(np.float32) * unit, 0.4, 0.05, persistence)
    found = filtered(TemporalFilter(alpha=0.4, depth_delta=0.05, persistence=persistence))
    whole = TemporalFilter(alpha=0.4).looks_back + 1
    assert np.abs(found[:whole] - wanted[:whole] / unit).max() < 1
    assert (found[:whole] != filtered(TemporalFilter(alpha=0.4, persistence=persistence))[:whole]).mean() > 0.01


@pytest.mark.parametrize("mode", [0, 1, 2])
def test_hole_filling(mode: int) -> None:
    np.testing.assert_array_equal(filtered(HoleFilling(mode=mode)), each(filled, frames(), mode))


@pytest.mark.parametrize("reach", [1, 2, 5])
@pytest.mark.parametrize("mode", [0, 1, 2, 3])
def test_hole_filling_reaches_so_far(mode: int, reach: int) -> None:
    """Of what is not measured that is filled which one that is measured is so near to, on the sides that are looked
    at; with the depth that it has without a limit where that came no farther."""
    some = frames()
    found, limitless = filtered(HoleFilling(mode=mode, reach=reach)), filtered(HoleFilling(mode=mode))
    for picture, now, without in zip(some, found, limitless, strict=True):
        there = picture > 0
        near = there.copy()
        for _ in range(reach):
            alone = {0: [(0, 1)], 3: [(1, 0)]}
            sides = alone.get(mode, [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0)])
            grown = near.copy()
            for down, right in sides:
                moved = np.roll(near, (down, right), (0, 1))
                moved[:, :right] = False
                moved[: 1 if down > 0 else 0], moved[len(moved) + min(down, 0) :] = False, False
                grown |= moved
            near = grown
        assert not (now > 0)[~near].any() and np.array_equal(now[there], picture[there])
        assert (now > 0).mean() > there.mean() + 0.3 * (near & (without > 0) & ~there).mean()
        if mode in alone:
            assert np.array_equal(now, np.where(near, without, 0))


@pytest.mark.parametrize("reach", [1, 3, 1000])
def test_hole_filling_with_means(reach: int) -> None:
    """Ring by ring, whatever the order of the pixels."""
    for picture, found in zip(frames()[:3], filtered(HoleFilling(mode=4, reach=reach))[:3], strict=True):
        z = picture.astype(np.float64)
        for _ in range(reach):
            there = ndimage.uniform_filter((z > 0).astype(np.float64), 3, mode="constant")
            mean = ndimage.uniform_filter(z, 3, mode="constant") / np.maximum(there, 1e-12)
            z = np.where(z > 0, z, np.where(there > 1e-9, mean, 0))
            if (z > 0).all():
                break
        assert np.abs(found - z).max() < 1 and (found[picture > 0] == picture[picture > 0]).all()
        assert np.array_equal(found > 0, z > 0)


def test_the_chain_in_its_order() -> None:
    """Decimation, threshold, disparity, spatial, temporal, depth, holes: whatever the order in the profile."""
    small = decimated(frames(), 2)
    small = np.where((small >= 102.4) & (small <= 2500), small, 0).astype(np.uint16)
    half = FACTOR / np.float32(2)  # the focal length of the smaller picture
    steps = averaged(each(smoothed, to_disparity(small, half), 0.5, 20, 2), 0.4, 20, 3)
    wanted = each(filled, to_raw(steps, half), 1)
    chain = [HoleFilling(), TemporalFilter(), SpatialFilter(), ThresholdFilter(farthest=2500 / 1024), Decimation()]
    np.testing.assert_array_equal(filtered(*chain)[:11], wanted[:11])


def test_the_smaller_camera() -> None:
    eye = Camera(width=1280, height=720, fx=640, fy=640, cx=639.5, cy=359.5, baseline=0.05)
    small = stored_camera(eye, [Decimation(factor=3)])
    assert (small.width, small.height) == (428, 240)  # as doc/post-processing-filters.md has it
    assert (small.fx, small.cx, small.cy) == pytest.approx((640 / 3, 639.5 / 3, 359.5 / 3))
    half = stored_camera(eye, [Decimation()])
    assert camera_for(half, [Decimation()]) == eye and half.shape == (360, 640)


def test_the_cameras_of_pictures_that_are_decimated_and_aligned_to_colour() -> None:
    both, eye = [AlignToColor(zoom=1.5), Decimation()], preset("d435", 640, 480)
    stored = stored_camera(eye, both)
    assert stored.aligned and stored.shape == (480, 640) and stored.left.shape == (240, 320)
    assert stored.left == stored_camera(eye, [Decimation()]) and stored.color == eye.color
    given = camera_for(stored, both)
    assert given == eye.aligned_to_color() and stored_camera(given, both) == stored
    assert measuring_camera(eye, both) == eye == measuring_camera(given, both)
    # An aligned camera brings its alignment.
    assert (camera_for(stored, [Decimation()]), stored_camera(given, [Decimation()])) == (given, stored)
    # One that does not say where its colour camera is has its pictures, and the left imager has as many pixels.
    plain = eye.model_copy(update={"color": None})
    assert stored_camera(plain, both) == camera_for(plain, both) == camera_for(eye, both) == plain
    left = measuring_camera(plain, both)
    assert left.shape == plain.shape and left.fx == pytest.approx(plain.fx / 1.5)


def test_a_run_is_made_like_one_that_is_decimated_and_aligned_to_colour(tmp_path: Path) -> None:
    effects = [*MEASURED, AlignToColor()]
    one = generate(SCENE.scene, MOVING.head(3), preset("d435", 160, 120), effects, tmp_path / "a", materials=MATERIALS)
    made = Run.open(one.path)
    assert made.camera.shape == (120, 160) and made.camera.left.shape == (60, 80)
    for name, profile in (("b", effects), ("c", MEASURED)):
        eye = camera_for(made.camera, profile)
        like = generate(SCENE.scene, MOVING.head(3), eye, profile, tmp_path / name, materials=MATERIALS)
        again = Run.open(like.path)
        assert again.camera == made.camera
        np.testing.assert_array_equal(again.depth_raw(2), made.depth_raw(2))
    # Where both cameras see it, it is near what the colour camera would see of the scene.
    clean = made.clean(2)
    assert clean is not None
    seen = (made.depth(2) > 0) & (clean > 0)
    error = made.camera.focal_baseline * np.abs(1 / made.depth(2)[seen] - 1 / clean[seen])
    assert seen.mean() > 0.5 and np.median(error) < 0.05


SCENE = Caster(as_scene(wall(3), box((-0.4, -0.3, 1.5), (0.1, 0.5, 1.9)), tags=["cement", "plastic"]))
MOVING = Trajectory(np.arange(20) / 30, np.linspace([-0.2, 0, 0], [0.2, 0, 0], 20), np.tile([0, 0, 0, 1.0], (20, 1)))
MEASURED = [DisparityNoise(sigma=0.1), *(e for e in load_profile("d435_filtered").effects if e.stage > 5)]


def measure(sensor: Sensor, index: int, **keys: Any) -> NDArray[np.uint16]:
    poses, stamps = MOVING.matrices(), MOVING.stamps
    keys = {"motion": Motion.along(MOVING), "stamp": float(stamps[index]), "seed": 3, **keys}
    return sensor.measure(poses[index], index=index, **keys).depth_raw.copy()


def test_a_frame_is_the_same_whichever_were_made_before() -> None:
    eye = camera(96, 72, 80)
    one, other = (Sensor(SCENE, eye, MEASURED, MATERIALS) for _ in range(2))
    order = [12, 3, 13, 12, 0, 19]
    found = {index: measure(one, index) for index in order}
    for index in sorted(found):
        np.testing.assert_array_equal(measure(other, index, threads=3), found[index])
    side = {}
    workers = [threading.Thread(target=lambda k=k: side.update({k: measure(one, k, threads=1)})) for k in (14, 15, 16)]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    for index, made in side.items():
        np.testing.assert_array_equal(measure(other, index), made)
    assert found[12].shape == (36, 48) and not np.array_equal(found[12], found[13])


def test_a_still_camera_is_less_noisy_by_the_filter_in_time() -> None:
    eye, noise = camera(96, 72, 80), DisparityNoise(sigma=0.1)
    flat = Caster(as_scene(wall(2.0)))

    def spread(*effects: Effect) -> float:
        depth = Sensor(flat, eye, effects, MATERIALS).measure(np.eye(4), index=40).depth
        return float((eye.focal_baseline / depth.astype(float)).std())

    kept = spread(noise, TemporalFilter(persistence=0)) / spread(noise)
    assert kept == pytest.approx(np.sqrt(0.4 / 1.6), abs=0.02)  # of an exponential average


def test_the_right_camera_stands_in_the_geometry_of_a_decimated_frame() -> None:
    sensor = Sensor(SCENE, camera(96, 72, 80), [Decimation()], MATERIALS)
    found = sensor.measure(np.eye(4))
    assert found.camera.shape == found.depth.shape == found.clean.depth.shape == (36, 48)
    assert np.median(np.abs(found.depth - found.clean.depth)) < 1e-3
    again = sensor.measure(np.eye(4), out=found)
    assert again.depth is found.depth


def _pyrealsense() -> Any:
    """The package, with the libusb that it asks the loader for."""
    try:
        import libusb_package

        ctypes.CDLL(str(libusb_package.get_library_path()), ctypes.RTLD_GLOBAL)
    except (ImportError, OSError):
        pass
    missing = "needs librealsense: pip install pyrealsense2 libusb-package"
    return pytest.importorskip("pyrealsense2", reason=missing, exc_type=ImportError)


def through_librealsense(rs: Any, blocks: Callable[[Any], Sequence[Any]]) -> Raw:
    """What librealsense's own processing blocks make of the frames, fed through its software device."""
    device, queue = rs.software_device(), rs.frame_queue(50)
    sensor = device.add_sensor("Depth")
    eye = rs.intrinsics()
    eye.width, eye.height, eye.fx, eye.fy = CAMERA.width, CAMERA.height, CAMERA.fx, CAMERA.fy
    eye.ppx, eye.ppy, eye.model, eye.coeffs = CAMERA.cx, CAMERA.cy, rs.distortion.none, [0] * 5
    stream = rs.video_stream()
    stream.type, stream.index, stream.uid, stream.width, stream.height = rs.stream.depth, 0, 1, eye.width, eye.height
    stream.fps, stream.bpp, stream.fmt, stream.intrinsics = 30, 2, rs.format.z16, eye
    profile = sensor.add_video_stream(stream).as_video_stream_profile()
    sensor.add_read_only_option(rs.option.depth_units, CAMERA.depth_scale)
    sensor.add_read_only_option(rs.option.stereo_baseline, 1e3 * CAMERA.baseline)
    sensor.open(profile)
    sensor.start(queue)
    chain, out = list(blocks(rs)), []
    for number, raw in enumerate(frames()):
        given = rs.software_video_frame()
        given.stride, given.bpp, given.pixels = 2 * CAMERA.width, 2, np.ascontiguousarray(raw)
        given.timestamp, given.frame_number, given.profile = 33.0 * number, number, profile
        given.depth_units = CAMERA.depth_scale
        sensor.on_video_frame(given)
        frame = queue.wait_for_frame(2000)
        for block in chain:
            frame = block.process(frame)
        out.append(np.asanyarray(frame.get_data()).copy())
    sensor.stop()
    sensor.close()
    return np.stack(out)


def to_and_fro(*blocks: Any) -> Callable[[Any], Sequence[Any]]:
    return lambda rs: [rs.disparity_transform(True), *(make(rs) for make in blocks), rs.disparity_transform(False)]


def spatial(alpha: float, delta: float, iterations: int) -> Any:
    return lambda rs: rs.spatial_filter(alpha, delta, iterations, 0)


def temporal(alpha: float, delta: float, persistence: int) -> Any:
    return lambda rs: rs.temporal_filter(alpha, delta, persistence)


CHAINS: dict[str, tuple[Callable[[Any], Sequence[Any]], list[Effect]]] = {
    **{f"decimation-{k}": (lambda rs, k=k: [rs.decimation_filter(k)], [Decimation(factor=k)]) for k in (2, 3, 4, 5, 8)},
    "threshold": (
        lambda rs: [rs.threshold_filter(1.25, 2.5)],
        [ThresholdFilter(nearest=1.25, farthest=2.5)],
    ),
    "disparity": (to_and_fro(), []),
    "spatial": (to_and_fro(spatial(0.5, 20, 2)), [SpatialFilter()]),
    "spatial-other": (to_and_fro(spatial(0.25, 5, 1)), [SpatialFilter(alpha=0.25, delta=5 / 32, iterations=1)]),
    **{
        f"temporal-{k}": (to_and_fro(temporal(0.4, 20, k)), [TemporalFilter(persistence=k)]) for k in range(9)
    },
    **{f"holes-{k}": (lambda rs, k=k: [rs.hole_filling_filter(k)], [HoleFilling(mode=k)]) for k in range(3)},
    "whole": (
        lambda rs: [
            rs.decimation_filter(2), rs.threshold_filter(0.1, 2.5),
            *to_and_fro(spatial(0.5, 20, 2), temporal(0.4, 20, 3))(rs), rs.hole_filling_filter(1),
        ],
        [Decimation(), ThresholdFilter(farthest=2.5), SpatialFilter(), TemporalFilter(), HoleFilling()],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", CHAINS)
def test_every_bit_is_that_of_librealsense(name: str) -> None:
    blocks, effects = CHAINS[name]
    wanted, found = through_librealsense(_pyrealsense(), blocks), filtered(*effects)
    # Frames that look back to the first one; from the twelfth on they leave it out.
    np.testing.assert_array_equal(found[:11], wanted[:11])


def test_a_run_is_the_same_bytes_on_any_threads_and_when_it_was_broken_off(tmp_path: Path) -> None:
    way, eye = MOVING.head(12), camera(96, 72, 80)
    runs = [
        generate(SCENE.scene, way, eye, MEASURED, tmp_path / str(k), threads=k, materials=MATERIALS, caster=SCENE).path
        for k in (1, 3)
    ]
    for name in sorted((runs[1] / "depth").iterdir())[3:9:2]:
        name.unlink()
    made = generate(SCENE.scene, way, eye, MEASURED, runs[1], threads=2, materials=MATERIALS, caster=SCENE).made
    one, other = ({p.name: p.read_bytes() for p in (run / "depth").iterdir()} for run in runs)
    assert made == 3 and len(one) == 12 and one == other
    run = Run.open(runs[0])
    assert run.camera == stored_camera(eye, MEASURED) and run.camera.shape == (36, 48) == run.depth_raw(0).shape


@pytest.mark.parametrize(("size", "may"), [((424, 240), True), ((640, 480), False), ((160, 90), False), (None, True)])
def test_a_recording_that_no_decimation_leaves_is_not_tried_with_it(size: tuple[int, int] | None, may: bool) -> None:
    setting = Setting(("cement",), np.ones(12), 1.0, MATERIALS, size=size)
    found = {candidate.effect for candidate in candidates([], setting)}
    assert ("decimation" in found) is may and {"temporal_filter", "hole_filling"} <= found
    assert "threshold_filter" not in found


def test_tiles_tell_the_factor_of_a_decimation() -> None:
    setting = Setting(("cement",), np.ones(12), 1.0, MATERIALS, size=(639, 480), tiled=3)
    shown = [c for c in candidates((), setting) if c.effect == "decimation"]
    assert [c.fixed for c in shown] == [{"upscaled": 1, "nearest": nearest} for nearest in (0, 1)]
    for one in shown:
        assert one.starts == ((3,),) and [(free.low, free.high) for free in one.free] == [(3, 3)]


@pytest.mark.parametrize(("size", "most"), [((320, 180), 4), ((424, 240), 3), ((640, 360), 2), (None, 8)])
def test_fits_make_no_larger_pictures_than_a_camera_has(size: tuple[int, int] | None, most: int) -> None:
    setting = Setting((), np.linspace(1, 4, 12), 1.0, MATERIALS, size=size)
    decimations = [c for c in candidates((), setting) if c.effect == "decimation"]
    assert {(free.key, free.low, free.high) for one in decimations for free in one.free} == {("factor", 1, most)}
