"""The ray caster against analytic truth and against float64 NumPy."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapes import as_scene, box, camera, first_hits, look_at, quad, random_poses, soup, sphere, wall, world_rays

from depthsim.errors import InputError
from depthsim.raycast import Caster
from depthsim.scene import NO_TAG, Scene

FEW = settings(max_examples=30)


@FEW
@given(
    st.floats(0, np.radians(89.5)),
    st.floats(-np.pi, np.pi),
    st.floats(0.3, 8),
    st.integers(0, 2**32),
)
def test_a_plane_of_any_tilt(tilt: float, azimuth: float, distance: float, seed: int) -> None:
    normal = np.array([np.sin(tilt) * np.cos(azimuth), np.sin(tilt) * np.sin(azimuth), -np.cos(tilt)])
    a = 40 * np.cross(normal, [np.sin(azimuth), -np.cos(azimuth), 0])
    b = np.cross(normal, a)
    vertices, faces = quad(np.array([0, 0, distance]) - a / 2 - b / 2, a, b)
    pose = random_poses(np.random.default_rng(seed), 1, 5)[0]
    scene, cam = as_scene((vertices @ pose[:3, :3].T + pose[:3, 3], faces)), camera()
    seen = Caster(scene).cast(cam, pose)
    _, rays = world_rays(cam, np.eye(4))
    along = (rays @ normal).reshape(cam.shape)
    with np.errstate(divide="ignore"):
        depth = distance * normal[2] / along
    cosine = np.abs(along) / np.linalg.norm(rays, axis=1).reshape(cam.shape)
    inside = (depth > 0) & (depth < 15)
    assume(inside.any())  # a plane that is nearly edge-on may leave the view before the middle pixel
    assert seen.hit[inside].all()
    assert not seen.hit[depth < 0].any()
    # Vertices 28 m from the middle are rounded to 2 µm, which a grazing ray feels as 1 / cosine.
    assert (np.abs(seen.depth - depth) * cosine)[inside].max() < 1e-5
    assert np.abs(seen.cosine - cosine)[inside].max() < 2e-6
    assert np.allclose(seen.normals(scene)[inside], np.cross(a, b) / (40 * 40) @ pose[:3, :3].T, atol=1e-6)


def test_depth_is_along_the_axis_and_not_along_the_ray() -> None:
    seen = Caster(as_scene(wall(2.5))).cast(camera(focal=20), np.eye(4))
    assert np.abs(seen.depth - 2.5).max() < 1e-6


def test_a_fine_sphere_is_a_sphere() -> None:
    radius, subdivisions = 1.5, 5
    vertices, faces = sphere(subdivisions, radius)
    cam, pose = camera(120, 90, 100), look_at((3.0, 1.0, 0.7), (0, 0, 0))
    seen = Caster(as_scene((vertices, faces))).cast(cam, pose)
    origins, rays = world_rays(cam, pose)
    a, b, c = (rays**2).sum(1), (rays * origins).sum(1), (origins**2).sum(1) - radius**2
    root = b * b - a * c
    depth = ((-b - np.sqrt(np.maximum(root, 0))) / a).reshape(cam.shape)
    point = origins + rays * depth.reshape(-1, 1)
    cosine = -(rays * point).sum(1) / np.sqrt(a) / radius
    flat = cosine.reshape(cam.shape) > 0.3
    assert flat.sum() > 2000
    edge = np.linalg.norm(vertices[faces[:, 0]] - vertices[faces[:, 1]], axis=1).max()
    sagitta = edge**2 / 3 / (2 * radius)  # of the largest triangle: its corners are edge / √3 from its middle
    error = (seen.depth - depth)[flat]
    assert error.min() > -1e-5  # the triangles lie inside the sphere
    assert error.max() < 1.1 * sagitta / 0.3
    assert not seen.hit.reshape(-1)[root < 0].any()
    assert np.abs(seen.cosine - cosine.reshape(cam.shape))[flat].max() < 0.03


@pytest.mark.parametrize("seed", range(3))
def test_a_tessellated_sphere_and_a_soup_against_float64(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene, cam = as_scene(sphere(2), soup(rng, 150), tags=["plastic", "cement"]), camera()
    for eye in rng.normal(size=(2, 3)):
        pose = look_at(3 * eye / np.linalg.norm(eye), (0, 0, 0))
        seen = Caster(scene).cast(cam, pose)
        depth, face, behind = first_hits(scene, *world_rays(cam, pose))
        depth, face, behind = (x.reshape(cam.shape) for x in (depth, face, behind))
        same = seen.face == face
        assert same.mean() > 0.999  # else an edge, within rounding
        sure = same & seen.hit & (behind > depth + 1e-5)
        assert sure.mean() > 0.3
        slant = np.maximum(seen.cosine, 1e-3)
        assert (np.abs(seen.depth - depth) * slant)[sure].max() < 3e-6
        _, rays = world_rays(cam, pose)
        unit = rays / np.linalg.norm(rays, axis=1, keepdims=True)
        cosine = np.abs((seen.normals(scene).reshape(-1, 3) * unit).sum(axis=1)).reshape(cam.shape)
        assert np.abs(seen.cosine - cosine)[same].max() < 1e-4
        assert np.array_equal(seen.tag, np.where(seen.hit, (seen.face >= 320).astype(np.uint8), NO_TAG))


def test_a_box_at_grazing_angles_from_within() -> None:
    low, high = np.array([-3.0, -2.0, -1.0]), np.array([4.0, 2.5, 1.5])
    scene, cam = as_scene(box(low, high)), camera(161, 121, 60)
    for eye, target in [
        ((-2.9, 2.49, 0.3), (4, 2.4, 0.2)),
        ((3.99, -1.9, 1.45), (3.9, 2, 1.4)),
        ((0, 0, -0.999), (4, 1, -1)),
    ]:
        pose = look_at(eye, target)
        seen = Caster(scene).cast(cam, pose)
        origins, rays = world_rays(cam, pose)
        with np.errstate(divide="ignore"):
            slabs = np.where(rays > 0, high - origins, low - origins) / rays
        axis = slabs.argmin(axis=1)
        depth = slabs.min(axis=1).reshape(cam.shape)
        cosine = np.take_along_axis(np.abs(rays), axis[:, None], 1)[:, 0] / np.linalg.norm(rays, axis=1)
        cosine = cosine.reshape(cam.shape)
        assert seen.hit.all()
        assert cosine.min() < 0.02
        assert (np.abs(seen.depth - depth) * cosine).max() < 2e-6
        # At an edge of the room either wall may be the one.
        normal = seen.normals(scene).reshape(-1, 3)
        right = np.abs(np.take_along_axis(normal, axis[:, None], 1)[:, 0]) == 1
        assert right.mean() > 0.995
        assert np.abs(seen.cosine - cosine)[right.reshape(cam.shape)].max() < 2e-6


@pytest.mark.parametrize("away", [(5e5, 0, 0), (-3e5, 4e5, 1e3)])
def test_millimetres_500_km_from_the_origin(away: tuple[float, ...]) -> None:
    rng = np.random.default_rng(5)
    near, faces = soup(rng, 100)
    pose = look_at((3, 0, 0), (0, 0, 0))
    there = pose.copy()
    there[:3, 3] += away
    here = Caster(as_scene((near, faces))).cast(camera(), pose)
    far = Caster(as_scene((near + np.array(away), faces))).cast(camera(), there)
    same = here.face == far.face
    assert same.mean() > 0.999
    assert (np.abs(here.depth - far.depth) * here.cosine)[same].max() < 1e-5


def test_a_vertex_without_a_face_costs_no_precision() -> None:
    vertices, faces = wall(2, half=3)
    scene = as_scene((np.concatenate([vertices, [[1e9, 1e9, np.nan]]]), faces))
    assert np.abs(Caster(scene).cast(camera(), np.eye(4)).depth - 2).max() < 1e-6


@pytest.mark.parametrize("size", [(637, 361), (5, 3), (1, 1), (4, 4), (3, 5), (1, 9), (6, 1)])
def test_an_image_of_odd_size_is_a_part_of_a_padded_one(size: tuple[int, int]) -> None:
    width, height = size
    caster = Caster(as_scene(soup(np.random.default_rng(6), 4000), sphere(2), tags=["plastic", "cement"]))
    keys = {"cx": width / 2, "cy": height / 2, "focal": width / 1.5}
    pose = look_at((2.5, 1, 0.5), (0, 0, 0))
    small = caster.cast(camera(width, height, **keys), pose, right=True)
    large = caster.cast(camera(width + 8 - width % 4, height + 8 - height % 4, **keys), pose, right=True)
    for name in ("depth", "face", "cosine", "tag", "right_sees"):
        assert np.array_equal(getattr(small, name), getattr(large, name)[:height, :width]), name
    assert small.hit.any()


def test_many_poses_are_the_single_ones() -> None:
    caster, cam = Caster(as_scene(soup(np.random.default_rng(7), 500))), camera(61, 47)
    poses = random_poses(np.random.default_rng(8), 5, 3)
    many = caster.cast(cam, poses, right=True)
    assert many.depth.shape == (5, 47, 61)
    for index, pose in enumerate(poses):
        one = caster.cast(cam, pose, right=True)
        for name in ("depth", "face", "cosine", "tag", "right_sees"):
            assert np.array_equal(getattr(many[index], name), getattr(one, name)), name
    assert caster.cast(cam, poses[:0]).depth.shape == (0, 47, 61)


def test_a_pose_a_row() -> None:
    caster, cam = Caster(as_scene(soup(np.random.default_rng(9), 500))), camera(41, 27)
    steps = np.linspace(0, 1, 2 * cam.height).reshape(2, cam.height)
    poses = np.array([[look_at((3 - s, s, s), (0, s / 2, 0)) for s in row] for row in steps])
    rolling = caster.cast(cam, poses, right=True)
    for n, row in np.ndindex(2, cam.height):
        one = caster.cast(cam, poses[n, row], right=True)
        for name in ("depth", "face", "cosine", "tag", "right_sees"):
            assert np.array_equal(getattr(rolling, name)[n, row], getattr(one, name)[row]), (name, n, row)


COEFFICIENTS = st.tuples(*[st.floats(-a, a) for a in (0.06, 0.02, 2e-3, 2e-3, 0.01)])


@FEW
@given(COEFFICIENTS)
def test_brown_conrady_rays_go_where_opencvs_formula_has_them(k: tuple[float, ...]) -> None:
    cam = camera(model="brown_conrady", distortion=k)
    # Planes z = 2 + x / 2 and z = 2 + y / 2 give x and y at z = 1 from the depth: x = 2 - 4 / depth.
    at_one = []
    for axis in (0, 1):
        a, b = np.zeros(3), np.zeros(3)
        a[[axis, 2]], b[1 - axis] = (12, 6), 40
        mesh = quad(np.array([0, 0, 2]) - a / 4 - b / 2, a, b)
        depth = Caster(as_scene(mesh)).cast(cam, np.eye(4)).depth.astype(float)
        at_one.append(2 - 4 / depth)
    x, y = at_one
    k1, k2, p1, p2, k3 = k
    r = np.hypot(x, y)
    radial = 1 + k1 * r**2 + k2 * r**4 + k3 * r**6
    u = cam.fx * (x * radial + 2 * p1 * x * y + p2 * (r**2 + 2 * x**2)) + cam.cx
    v = cam.fy * (y * radial + p1 * (r**2 + 2 * y**2) + 2 * p2 * x * y) + cam.cy
    rows, columns = np.mgrid[: cam.height, : cam.width]
    assert np.abs(u - columns).max() < 1e-4
    assert np.abs(v - rows).max() < 1e-4


def test_nothing_hit() -> None:
    scene = as_scene(wall(2, half=1))
    seen = Caster(scene).cast(camera(), look_at((0, 0, 0), (0, 0, -1), up=(1, 0, 0)), right=True)
    assert not seen.hit.any()
    assert not seen.depth.any() and not seen.cosine.any() and not seen.right_sees.any()
    assert (seen.face == -1).all() and (seen.tag == NO_TAG).all()
    assert not seen.normals(scene).any()


def test_faces_without_area_are_not_hit() -> None:
    vertices, faces = wall(2)
    thin = np.concatenate([[[0, 0, 0], [1, 1, 1], [2, 2, 1]], faces]).astype(np.uint32)
    seen = Caster(as_scene((vertices, thin))).cast(camera(), np.eye(4))
    assert (seen.face >= 3).all()
    assert np.isfinite(seen.cosine).all()


def scene_with(**changes: object) -> Scene:
    keys = {"vertices": wall(2)[0], "faces": wall(2)[1], "face_tags": np.zeros(2, np.uint8), **changes}
    return Scene(name="broken", tags=("cement",), **keys)


@pytest.mark.parametrize(
    ("scene", "problem"),
    [
        (scene_with(faces=np.array([[0, 1, 4]], np.uint32)), "a face with vertex 4, but 4 vertices"),
        (scene_with(faces=np.zeros((0, 3), np.uint32), face_tags=np.zeros(0, np.uint8)), "has no faces"),
        (scene_with(vertices=np.zeros((0, 3))), "a face with vertex 3, but 0 vertices"),
        (scene_with(vertices=wall(np.nan)[0]), "a vertex that is not finite"),
        (scene_with(face_tags=np.zeros(1, np.uint8)), "2 faces, but 1 tags"),
    ],
)
def test_what_would_break_the_kernel_is_refused(scene: Scene, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        Caster(scene)


def test_arguments_that_do_not_fit_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    caster, cam = Caster(as_scene(wall(2))), camera()
    for poses in (np.eye(3), np.eye(4)[None, None, None], np.broadcast_to(np.eye(4), (1, 47, 4, 4))):
        with pytest.raises(ValueError, match="poses"):
            caster.cast(cam, poses)
    with pytest.raises(ValueError, match="not finite"):
        caster.cast(cam, np.full((4, 4), np.nan))
    with pytest.raises(ValueError, match="rays"):
        caster.cast(cam, np.eye(4), rays=np.zeros((2, 3, 4), np.float32))
    monkeypatch.setenv("DEPTHSIM_RAYCASTER", "povray")
    with pytest.raises(InputError, match="DEPTHSIM_RAYCASTER: there is no ray caster 'povray'; use embree or embreex"):
        Caster(as_scene(wall(2)))
