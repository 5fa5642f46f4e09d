"""A folder that Open3D's reconstruction system reads, and systems that take ICL-NUIM.

    depth/000000.png  color/000000.png  intrinsic.json  trajectory.log
    associations.txt  groundtruth.txt  camera.yaml

trajectory.log is that of the Redwood data set: for each frame its number three times, and its pose, camera to world, as
a 4x4 matrix. associations.txt is "stamp depth/NAME.png stamp color/NAME.png", as the TUM version of ICL-NUIM has it.
Depth is in the run's own units. Sources: Open3D 0.20, examples/python/t_reconstruction_system; ICL-NUIM (Handa et al.,
ICRA 2014).
"""

import json
from pathlib import Path

from depthsim.exporting.tables import colour
from depthsim.runs import Run, layout
from depthsim.runs.png import encode_png
from depthsim.runs.storing import write_whole
from depthsim.trajectory import tum_text


def write(run: Run, out: Path, _: object) -> str:
    """Write the folder; says how Open3D's programs are given it."""
    names = [f"{index:06d}.png" for index in range(len(run))]
    has_rgb = run.has("rgb")
    for folder in ("depth", *(("color",) if has_rgb else ())):
        (out / folder).mkdir()
    for index, name in enumerate(names):
        write_whole(out / "depth" / name, encode_png(run.depth_raw(index)))
        image = run.rgb(index) if has_rgb else None
        if image is not None:
            write_whole(out / "color" / name, encode_png(colour(image)))
    camera = run.camera
    matrix = [camera.fx, 0.0, 0.0, 0.0, camera.fy, 0.0, camera.cx, camera.cy, 1.0]  # column by column
    intrinsic = {"width": camera.width, "height": camera.height, "intrinsic_matrix": matrix}
    write_whole(out / "intrinsic.json", (json.dumps(intrinsic, indent=2) + "\n").encode())
    write_whole(out / "trajectory.log", _log(run).encode())
    write_whole(out / "associations.txt", _associations(run, names, has_rgb).encode())
    write_whole(out / layout.GROUND_TRUTH, tum_text(run.truth).encode())
    write_whole(out / layout.CAMERA, camera.to_yaml().encode())
    scale = 1 / camera.depth_scale
    lacking = "" if has_rgb else "; no color/, as the run has no rgb"
    if any(camera.distortion):
        lacking += "; the distortion is in camera.yaml alone, as Open3D has none"
    return f"{len(run)} frames, depth_scale {scale:g}{lacking}"


def _log(run: Run) -> str:
    lines = []
    for index, pose in enumerate(run.poses.tolist()):
        lines.append(f"{index} {index} {index}")
        lines.extend(" ".join(map(repr, row)) for row in pose)
    return "\n".join(lines) + "\n"


def _associations(run: Run, names: list[str], has_rgb: bool) -> str:
    pairs = zip(run.stamps, names, strict=True)
    ends = ((f"{stamp:.6f}", name) for stamp, name in pairs)
    return "".join(f"{s} depth/{n}" + (f" {s} color/{n}" if has_rgb else "") + "\n" for s, n in ends)
