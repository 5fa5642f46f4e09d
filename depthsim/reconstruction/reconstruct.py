"""A scene from a recording: its depth fused into a mesh, and masks of where that mesh may be trusted.

Fusion is a truncated signed distance function in voxel blocks (Curless and Levoy, SIGGRAPH 1996; Open3D's
VoxelBlockGrid). What it hides: a bias that all views of a surface share, such as a wrong baseline, a wrong depth scale
or a warp that stays with the pixel while the camera looks from one side, moves the mesh with the depth and is gone from
the difference of both. What it shows: whatever differs from view to view, such as noise, holes, quantisation, edges,
drift with time, and bias that changes with range or incidence where a surface was seen from several.
"""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.materials import load_materials
from depthsim.odometry.open3d_images import FUSING, depth_image, intrinsic_matrix, quiet_open3d
from depthsim.odometry.systems import estimate
from depthsim.raycast import Caster
from depthsim.reconstruction.mask import trusted
from depthsim.runs import layout
from depthsim.runs.folder import Run, open_run
from depthsim.runs.png import encode_png
from depthsim.runs.storing import FolderLock, write_whole
from depthsim.runs.whole import whole_folder
from depthsim.scene import Scene
from depthsim.scenefile.save import save_scene
from depthsim.trajectory import Trajectory, read_tum, tum_text

TRUNCATION = 4.0
"""In voxels."""
_FUSED = " fused"
"""How the names of such scenes end."""
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Reconstruction:
    """What was made: the scene, and the share of the pixels with depth where it is trusted."""

    scene: Scene
    trusted: float


def reconstruct(
    run: str | Path | Run,
    out: str | Path | None = None,
    *,
    poses: str | Path | Trajectory | None = None,
    voxel: float = 0.02,
    depth_max: float = 4.0,
    least_views: int = 5,
    tag: str = "cement",
    progress: Progress = lambda done, total: None,
    say: Callable[[str], None] = lambda _: None,
) -> Reconstruction:
    """Fuse a run into a mesh, and write it with masks into ``out``: a new folder with a copy of the run, or its own.

    poses: camera to world, at all stamps of the run: a trajectory, a TUM file, or ``odometry`` for Open3D's; the run's
    own by default, and where it has none, odometry. voxel, depth_max: [m]. least_views: how many frames must have seen
    a surface. tag: the material of the whole mesh. say: called with a line where poses had to be estimated.
    Raises :class:`InputError` for a run that has a scene or masks already, where ``out`` is its own folder; for an
    unknown tag; and where nothing was seen often enough.
    """
    if tag not in load_materials():
        raise InputError("`tag`", tag, "is no material", "give a tag of materials.yaml")
    run = open_run(run, posed=False)
    poses, out = _poses(run, poses, say), run.path if out is None else Path(out)
    truth = poses or run.trajectory
    at = truth.at(run.stamps)
    same = out.absolute() == run.path.absolute()
    if same:
        _refuse_scene(run)
    scene = fuse(run, at.matrices(), voxel, depth_max, least_views, tag, progress)
    masks, share = _masks(run, scene, at.matrices(), voxel, depth_max)
    if same:
        lock = FolderLock(out)
        try:
            _write(out, scene, run, masks, poses)
        finally:
            lock.release()
    else:
        with whole_folder(out) as folder:
            _copy(run, folder)
            _write(folder, scene, run, masks, poses)
    return Reconstruction(scene, share)


def _poses(run: Run, choice: str | Path | Trajectory | None, say: Callable[[str], None]) -> Trajectory | None:
    """The poses to fuse by; None for those of the run."""
    if isinstance(choice, Trajectory) or (choice is None and (run.path / layout.GROUND_TRUTH).exists()):
        return choice
    if choice is not None and str(choice) != "odometry":
        return read_tum(Path(choice))
    found = estimate(run, "open3d-odometry")
    if len(found.trajectory) < found.frames:
        problem = f"the odometry lost its track after {len(found.trajectory)} of {found.frames} frames"
        raise InputError(run.path, "", problem, "give `poses`, the TUM trajectory of a better system")
    say(f"{run.path}: poses by open3d-odometry in {found.seconds:.0f} s")
    return found.trajectory


def fuse(
    run: Run,
    poses: NDArray[np.float64],
    voxel: float,
    depth_max: float,
    least_views: int,
    tag: str,
    progress: Progress = lambda done, total: None,
    blocks: int = 2_500,
) -> Scene:
    """The mesh of all frames, of surfaces that ``least_views`` frames or more have seen; poses (N, 4, 4).

    blocks: of 16^3 voxels, 32 kB each, that there is room for to begin with; to touch more takes seconds.
    """
    o3d = quiet_open3d()
    core = o3d.core
    grid = o3d.t.geometry.VoxelBlockGrid(
        attr_names=("tsdf", "weight"),
        attr_dtypes=(core.float32, core.float32),
        attr_channels=((1), (1)),
        voxel_size=voxel,
        block_resolution=16,
        block_count=blocks,
        device=core.Device("CPU:0"),
    )
    intrinsic, scale = intrinsic_matrix(o3d, run.camera, FUSING), 1 / run.camera.depth_scale
    empty = True
    for index, pose in enumerate(poses):
        depth = depth_image(o3d, run, index)
        metres = run.depth(index)
        if ((metres > 0) & (metres < depth_max)).any():
            empty = False
            extrinsic = core.Tensor(np.linalg.inv(pose))
            seen = grid.compute_unique_block_coordinates(depth, intrinsic, extrinsic, scale, depth_max, TRUNCATION)
            grid.integrate(seen, depth, intrinsic, extrinsic, scale, depth_max, TRUNCATION)
        progress(index + 1, len(poses))
    faces = np.empty((0, 3), np.uint32)
    if not empty:
        # Each view adds one to a voxel's weight, and Open3D keeps what is above the threshold, not what is at it.
        try:
            mesh = grid.extract_triangle_mesh(weight_threshold=least_views - 0.5)
            faces = mesh.triangle.indices.numpy().astype(np.uint32) if len(mesh.vertex) else faces
        except RuntimeError as error:
            if "SetVertexColors" not in str(error):  # what it says of a mesh without vertices, if it has no colours
                raise
    if not len(faces):
        problem = f"has no surface nearer than {depth_max:g} m that {least_views} frames have seen"
        raise InputError(run.path, "", problem, "give more frames, better poses, or a larger `depth_max`")
    vertices = mesh.vertex.positions.numpy().astype(np.float64)
    return Scene(f"{run.path.absolute().name}{_FUSED}", vertices, faces, np.zeros(len(faces), np.uint8), (tag,))


def is_fused(scene: Scene) -> bool:
    """Whether a scene was made by :func:`fuse`; its name says so."""
    return scene.name.endswith(_FUSED)


def _masks(
    run: Run, scene: Scene, poses: NDArray[np.float64], voxel: float, depth_max: float
) -> tuple[list[NDArray[np.bool_]], float]:
    """The mask of each frame, and the share of the pixels with depth that are in it."""
    caster, masks = Caster(scene), []
    inside = measured = 0
    for index, pose in enumerate(poses):
        mask = trusted(caster.cast(run.camera, pose), run.camera, voxel * TRUNCATION, depth_max)
        there = run.depth(index) > 0
        inside += int((mask & there).sum())
        measured += int(there.sum())
        masks.append(mask)
    return masks, inside / max(measured, 1)


def _refuse_scene(run: Run) -> None:
    if run.scene is not None:
        raise InputError(run.path, run.scene.name, "is a scene already", "give `out`, a new folder")
    if (run.path / "mask").is_dir():
        raise InputError(run.path, "mask", "is there already", "give `out`, a new folder")


def _copy(run: Run, folder: Path) -> None:
    """The run without its scene and its masks."""
    left_out = {*layout.SCENES, "scene.mtl", "mask", "slam", "clean", "material", "normal", "clean.txt", layout.PREVIEW}
    for entry in run.path.iterdir():
        if entry.name in left_out or entry.name.startswith("."):
            continue
        copy = shutil.copytree if entry.is_dir() else shutil.copy2
        copy(entry, folder / entry.name)


def _write(out: Path, scene: Scene, run: Run, masks: Sequence[NDArray[np.bool_]], poses: Trajectory | None) -> None:
    (out / "mask").mkdir()
    for file, mask in zip(run.files, masks, strict=True):
        write_whole(out / "mask" / file.name, encode_png(mask.astype(np.uint8) * np.uint8(255)))
    if poses is not None:
        write_whole(out / layout.GROUND_TRUTH, tum_text(poses).encode())
    save_scene(scene, out)
