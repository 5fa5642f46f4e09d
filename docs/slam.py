"""Make docs/slam.md and its pictures: `./run python docs/slam.py [FOLDER]`; FOLDER keeps the runs and what is done."""

import os
import sys
import tempfile
from pathlib import Path

import numpy as np

from depthsim.errors import InputError
from depthsim.odometry import SYSTEMS, estimate, score
from depthsim.odometry.results import put_row, read_rows, row_of
from depthsim.odometry.sweep import noise_of
from depthsim.odometry.sweep_plot import COLOURS
from depthsim.odometry.systems import DEPTH_MAX as DEPTH_RANGE
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.reconstruction.mask import trusted
from depthsim.reconstruction.reconstruct import TRUNCATION, fuse
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.runs.storing import write_whole
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory

OUT = Path(__file__).resolve().parent
SCENES = ("office", "tunnel", "corridor")
PROFILES = ("clean", "paper", "d435")
SIZE, FRAMES = (424, 240), 150
VOXEL, DEPTH_MAX, LEAST_VIEWS = 0.02, 4.0, 5
Table = dict[tuple[str, str, str], dict[str, str]]


def runs(folder: Path) -> dict[tuple[str, str], Run]:
    """The first 5 s of each scene's trajectory through each sensor."""
    made = {}
    for name in SCENES:
        scene, camera = load_scene(name), preset("d435", *SIZE)
        path = load_trajectory(None, scene, camera.rate, FRAMES)
        for profile in PROFILES:
            out = folder / f"{name}_{profile}"
            generate(scene, path, camera, load_profile(profile), out)
            made[name, profile] = Run.open(out)
    return made


def scores(made: dict[tuple[str, str], Run], folder: Path) -> Table:
    """The row of results.csv of each scene, profile and system; what is in it already is not run again."""
    table: Table = {}
    for system in SYSTEMS:
        for (name, profile), run in made.items():
            rows = read_rows(folder / "results.csv")
            row = next((r for r in rows if (r["run"], r["system"]) == (run.path.name, system)), None)
            if row is None:
                found = estimate(run, system)
                try:
                    row = row_of(
                        run.path.name, system, found.frames, score(run.trajectory, found.trajectory), found.seconds
                    )
                except InputError:
                    continue  # lost at once
                put_row(folder / "results.csv", row)
                print(f"{run.path.name} {system}: ATE {100 * float(row['ate_m']):.2f} cm", file=sys.stderr, flush=True)
            table[name, profile, system] = row
    return table


def picture(table: Table) -> bytes:
    """A group of bars for each scene and profile, a bar a system."""
    import io

    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, len(SCENES), figsize=(11, 3.6), sharey=True, layout="constrained")
    for axes, scene in zip(panels, SCENES, strict=True):
        for place, system in enumerate(SYSTEMS):
            for index, profile in enumerate(PROFILES):
                row = table.get((scene, profile, system))
                x = index + (place - 1) * 0.27
                if row is None:
                    axes.text(x, 0.02, "lost", rotation=90, ha="center", transform=axes.get_xaxis_transform())
                    continue
                value = 100 * float(row["ate_m"])
                axes.bar(x, value, 0.25, color=COLOURS[system], label=system if not index else None)
                cut = "*" if row["tracked"] != row["frames"] else ""
                axes.text(x, value, f"{_figure(row['ate_m'])}{cut}", ha="center", va="bottom", fontsize=7)
        axes.set_title(scene, fontsize=11)
        axes.set_xticks(range(len(PROFILES)), PROFILES)
        axes.set_yscale("log")
        axes.axhline(2, color="#888888", lw=0.8, ls=":")
        axes.grid(alpha=0.2, axis="y")
        axes.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("ATE [cm]")
    panels[0].legend(frameon=False, fontsize=8, loc="upper left")
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=110)
    plt.close(figure)
    return data.getvalue()


def _figure(share: str) -> str:
    """Hundredths, with two figures or as a whole number."""
    value = 100 * float(share)
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}"


def table_text(table: Table) -> str:
    """The table of docs/slam.md: ATE and drift."""
    lines = ["| scene | profile | " + " | ".join(SYSTEMS) + " |", "| --- " * (2 + len(SYSTEMS)) + "|"]
    for scene in SCENES:
        for profile in PROFILES:
            cells = []
            for system in SYSTEMS:
                row = table.get((scene, profile, system))
                if row is None:
                    cells.append("lost")
                    continue
                cut = f" ({row['tracked']} of {row['frames']} frames)" if row["tracked"] != row["frames"] else ""
                # A track that is lost within the first metre has no stretch of a metre to drift over.
                drift = f", {_figure(row['drift_m_per_m'])} %" if row["drift_m_per_m"] else ""
                cells.append(f"{_figure(row['ate_m'])} cm{drift}{cut}")
            lines.append(f"| {scene} | {profile} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def fused(made: dict[tuple[str, str], Run]) -> list[str]:
    """Rows that compare a fused mesh with the scene: error of the mesh's depth inside and outside of the masks."""
    rows = []
    for profile in PROFILES:
        run = made["office", profile]
        mesh = fuse(run, run.poses, VOXEL, DEPTH_MAX, LEAST_VIEWS, "cement")
        caster, errors = Caster(mesh), {True: [np.empty(0)], False: [np.empty(0)]}
        share = []
        for index in range(0, len(run), 10):
            seen = caster.cast(run.camera, run.poses[index])
            mask = trusted(seen, run.camera, VOXEL * TRUNCATION, DEPTH_MAX)
            clean = run.clean(index)
            assert clean is not None
            both = seen.hit & (clean > 0) & (clean < DEPTH_MAX)
            for inside in (True, False):
                part = both & (mask == inside)
                errors[inside].append((seen.depth[part] - clean[part]) * 1000)
            share.append(mask[both].mean())
        cells = []
        for inside in (True, False):
            every = np.concatenate(errors[inside])
            cells.append(
                f"{np.median(every):+.1f}, {np.median(np.abs(every)):.1f}, {np.quantile(np.abs(every), 0.95):.0f}"
            )
        rows.append(f"| {profile} | {cells[0]} | {cells[1]} | {100 * np.mean(share):.0f} % |")
    return rows


def page(table: Table, noise: dict[tuple[str, str], float], meshes: list[str]) -> str:
    """The text of docs/slam.md."""
    level = ", ".join(
        f"{profile} {' / '.join(f'{1000 * noise[scene, profile]:.1f}' for scene in SCENES)}" for profile in PROFILES
    )
    return f"""# SLAM on runs, and scenes from recordings

Made by `docs/slam.py`; do not edit the figures.

    depthsim slam office_run --with open3d-slam --with open3d-odometry --with kiss-icp    # ATE, RPE, drift, by evo
    depthsim slam office_run --estimate CameraTrajectory.txt    # any other system's TUM file
    depthsim slam office_run --sweep --profiles clean,paper,d435,active_stereo --speeds 1,2

The last one makes the run again with other sensors and speeds and draws error over noise. Outside of `./run`,
`pip install '.[slam]'` brings the systems and evo.

## How error follows noise

The first {FRAMES / 30:g} s ({FRAMES} frames at 30 Hz) of the default trajectories, {SIZE[0]}x{SIZE[1]}, geometry of a
D435, seed 0. Each system has one set of settings for all scenes, in its file in `depthsim/odometry/`, with what was
tried; kiss-icp is given 10 frames a second. In each cell the absolute trajectory error (rigid alignment, root mean
square) and the mean drift over stretches of a metre of the true path, both by evo. All of it ran on one core, where it
gives the same figures again. On several, Open3D adds up in the order in which its threads finish, and a track that is
nearly lost goes one way or another: four runs of open3d-odometry on the office's d435 ended at 5.3 and 12.2 to 12.4 cm.

{table_text(table)}

![ATE by scene, profile and system; the dotted line is 2 cm](pictures/slam.png)

The noise of the depth nearer than {DEPTH_RANGE:g} m (1.4826 times the median of |depth - clean|) is, in mm, for
{" / ".join(SCENES)}: {level}.

## Importing: what the poses are of, and which calibration

A run's poses are those of the camera's optical frame: x right, y down, z forward. `depthsim import` finds the way there
by tf where a topic names the frame that its poses are of. A `PoseStamped`, as motion capture gives it, names none, and
is read as the camera's with a line that says so; `--mount x,y,z,qx,qy,qz,qw` says where the camera is in the frame of
the poses, in metres and a unit quaternion: the pose of the camera is (pose of the body) * (mount). It applies to a
topic (in place of tf), to a TUM file and to groundtruth.txt, and to poses from tf (there in the frame of the depth
images). A camera that looks along the x axis of its body is `--mount 0,0,0,-0.5,0.5,-0.5,0.5`. The distortion of a
CameraInfo must be plumb_bob's, k1 k2 p1 p2 k3, or zero; one of another model (equidistant, eight terms) is refused.

A TUM RGB-D sequence has no camera file; its name says which camera it was. The page of the data set gives two
calibrations: 525, 525, 319.5, 239.5 to make clouds of depth, as the driver made both images straight, and that of the
colour camera with its distortion. 120 real frames of freiburg1_xyz decide, by how far pixels of one frame lie from the
surface in another, along its normal, at the motion capture's poses (`benchmarks/tum_calibration.py`): the median and
what 90 % stay below, in mm, with the poses as they are, after the time offset that fits best, and after the best turn
and shift of the camera against the poses, too.

| calibration | poses as they are | time offset | hand-eye motion, too | turned by x, y, z | offset |
| --- | --- | --- | --- | --- | --- |
| 525, 525, 319.5, 239.5 (the driver's default) | 7.28, 21.1 | 5.81, 17.6 | 3.57, 9.8 | +0.2, -1.0, +1.1° | -18 ms |
| infrared | 7.32, 22.7 | 5.50, 17.3 | 3.52, 10.5 | +0.6, -0.8, +1.6° | -19 ms |
| infrared with its distortion | 7.48, 23.3 | 5.72, 17.6 | 3.58, 10.8 | +0.7, -0.8, +1.6° | -19 ms |
| RGB | 6.89, 20.2 | 5.02, 16.3 | 3.56, 9.7 | -1.4, -1.1, +0.9° | -18 ms |
| RGB's centre, focal length 525 | 6.68, 19.7 | 4.78, 15.2 | 3.46, 9.4 | -1.4, -1.1, +1.0° | -18 ms |
| nearest pinhole to RGB with its distortion | 6.62, 19.6 | 4.71, 15.1 | 3.41, 9.3 | -1.3, -1.1, +1.0° | -18 ms |
| RGB with its distortion | 6.66, 19.8 | 4.86, 15.1 | 3.36, 9.3 | -1.3, -1.1, +1.0° | -18 ms |

At equal focal length the colour camera's centre fits better than the driver's, however poses and stamps are refined,
and the colour camera's calibration better with its distortion than without. So that is what `import` takes for
freiburg1; likewise for freiburg2, the same kind of camera and driver, and freiburg3, whose distortion the page gives
as zero, though no frames of these were measured. What the frames leave open: whether depth is bent just so, as the
nearest pinhole does about as well; left free, the focal length goes to 547 px and the camera back by 6 cm. Depth stamps
18 ms late and a camera turned by 2 degrees are the recording's own errors, and stay in the run. `--camera` takes
another calibration.

## A scene from a recording

`depthsim reconstruct` fuses a run's depth into a mesh (`scene.yaml`, `scene.ply`) and writes `mask/`: where it was
seen by {LEAST_VIEWS} frames or more, not at a grazing angle, and farther than the truncation distance from every edge.
Then the run can be compared with a scene although there is no CAD model. Poses are the run's, `--poses FILE`, or those
of open3d-odometry. Open3D's fusion takes whole pixel coordinates for corners, and all else takes them for centres; both
`reconstruct` and open3d-slam move the principal point by half a pixel there, without which slanted surfaces are off by
centimetres at low resolution. Whoever fuses an exported run by Open3D itself should do the same. Open3D has no
distortion either: frames that have one are made straight first, each pixel by the nearest recorded one.

The office, fused from {FRAMES} frames at their true poses; depth of the mesh minus true depth, in mm: median, median
size, and the size that 95 % stay below.

| profile | trusted | not trusted | share trusted |
| --- | --- | --- | --- |
{chr(10).join(meshes)}

What such a scene hides: a bias that all views of a surface share. A wrong baseline or focal length, a wrong depth
scale, a disparity offset seen from one range only, or a warp that stays with the pixel while the camera looks from one
side, moves the mesh along with the depth and is gone from their difference. An error of the poses goes into the mesh as
blur, and is then read as noise of the camera. What it shows: all that differs between views, such as noise and its
growth with range, holes, quantisation, edges, drift over time, correlation, and a bias that depends on range or
incidence where surfaces were seen from several. For the rest, put something of known size into the scene.
"""


def main() -> None:
    """Write the page and its picture, on one core: Open3D adds up in whatever order its threads finish."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else temporary)
        made = runs(folder)
        table = scores(made, folder)
        noise = {key: noise_of(run) for key, run in made.items()}
        (OUT / "pictures").mkdir(exist_ok=True)
        write_whole(OUT / "pictures" / "slam.png", picture(table))
        write_whole(OUT / "slam.md", page(table, noise, fused(made)).encode())
    print(f"{OUT}: slam.md and pictures/slam.png", file=sys.stderr)


if __name__ == "__main__":
    main()
