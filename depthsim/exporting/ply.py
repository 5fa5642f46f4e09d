"""Point clouds: clouds/000000.ply and on, a binary PLY for each frame, and where the camera was.

Points are in the camera's optical frame [m], in the order of the pixels that have a return, as float32: z is the depth
as measured, and x = X(u) z, y = Y(v) z of the pixel's ray. groundtruth.txt (TUM) and poses.txt (KITTI: the upper 3x4 of
each pose in a line) take them to the world.
"""

from pathlib import Path

import numpy as np

from depthsim.exporting.tables import colour, points_of
from depthsim.runs import Run, layout
from depthsim.runs.storing import write_whole
from depthsim.trajectory import tum_text


def write(run: Run, out: Path, _: object) -> str:
    """Write the clouds; says how many."""
    (out / "clouds").mkdir()
    has_rgb = run.has("rgb")
    for index in range(len(run)):
        write_whole(out / "clouds" / f"{index:06d}.ply", cloud(run, index, has_rgb))
    write_whole(out / layout.GROUND_TRUTH, tum_text(run.truth).encode())
    rows = run.poses[:, :3].reshape(len(run), 12).tolist()
    write_whole(out / "poses.txt", "".join(" ".join(map(repr, row)) + "\n" for row in rows).encode())
    write_whole(out / layout.CAMERA, run.camera.to_yaml().encode())
    return f"{len(run)} clouds"


def cloud(run: Run, index: int, coloured: bool) -> bytes:
    """The PLY of one frame."""
    points, seen = points_of(run, index)
    fields = [("x", "<f4"), ("y", "<f4"), ("z", "<f4")]
    header = ["property float x", "property float y", "property float z"]
    if coloured:
        fields += [("red", "u1"), ("green", "u1"), ("blue", "u1")]
        header += ["property uchar red", "property uchar green", "property uchar blue"]
    table = np.empty(len(points), fields)
    table["x"], table["y"], table["z"] = points.T
    image = run.rgb(index) if coloured else None
    if image is not None:
        table["red"], table["green"], table["blue"] = colour(image)[seen].T
    lines = ["ply", "format binary_little_endian 1.0", f"comment stamp {run.stamps[index]:.6f}"]
    lines += [f"element vertex {len(points)}", *header, "end_header\n"]
    return "\n".join(lines).encode() + table.tobytes()
