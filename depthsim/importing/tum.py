"""TUM RGB-D sequences (Sturm et al., IROS 2012), as they are downloaded: depth.txt, rgb.txt, groundtruth.txt.

They have no camera file. Where the folder has no camera.yaml and none is given, a name with freiburg1, 2 or 3 in it
gives the calibration of the colour camera on the data set's page, distortion and all, and 5000 units to the metre. The
driver has put the depth images into the colour images. The page says that it made both straight and gives 525, 525,
319.5, 239.5 for depth; the frames of freiburg1 say otherwise (benchmarks/tum_calibration.py; docs/slam.md). freiburg2
was the same kind of camera with the same driver, and freiburg3's images have no distortion on the page; no frames of
them were measured. The baseline, 75 mm, is the Kinect's.
"""

import re
from pathlib import Path

from depthsim.camera import Camera, read_camera
from depthsim.errors import InputError
from depthsim.importing.options import Imported, ImportOptions
from depthsim.importing.recording import Recording
from depthsim.presets import resolve_camera
from depthsim.runs import layout
from depthsim.runs.folder import read_list
from depthsim.runs.png import decode_png

FREIBURG = {
    "1": ((517.3, 516.5, 318.6, 255.3), (0.2624, -0.9531, -0.0054, 0.0026, 1.1633)),
    "2": ((520.9, 521.0, 325.1, 249.7), (0.2312, -0.7849, -0.0033, -0.0001, 0.9172)),
    "3": ((535.4, 539.2, 320.1, 247.6), (0.0, 0.0, 0.0, 0.0, 0.0)),
}
"""fx, fy, cx, cy [px] of each colour camera, and k1, k2, p1, p2, k3."""
UNITS = 5000.0
KINECT_BASELINE = 0.075


def read_sequence(source: Path, folder: Path, options: ImportOptions) -> Imported:
    """Copy a sequence into ``folder`` as a run."""
    camera = _camera(source, options)
    recording = Recording(folder, source)
    stamps, files, _ = read_list(source / layout.list_name(layout.DEPTH))
    for stamp, file in zip(stamps, files, strict=True):
        depth = decode_png(file)
        if depth.dtype != "uint16" or depth.ndim != 2:
            raise InputError(file, "", "is not a 16-bit grey PNG", "give depth as 16-bit grey PNG")
        recording.add(layout.DEPTH, float(stamp), depth)
    listed = source / layout.list_name("rgb")
    if listed.exists():
        stamps, files, _ = read_list(listed)
        for stamp, file in zip(stamps, files, strict=True):
            image = decode_png(file)
            if image.dtype != "uint8" or image.shape[:2] != camera.shape:
                problem = f"is {image.shape[1]}x{image.shape[0]} of {image.dtype}"
                raise InputError(file, "", problem, f"give 8-bit images of {camera.width}x{camera.height}")
            recording.add("rgb", float(stamp), image)
    poses = options.poses_of(source)
    frames, notes = recording.finish(camera, poses)
    return Imported(frames, poses is not None, tuple(notes))


def _camera(source: Path, options: ImportOptions) -> Camera:
    if options.camera is not None:
        return resolve_camera(options.camera)
    if (source / layout.CAMERA).exists():
        return read_camera(source / layout.CAMERA)
    found = re.search(r"freiburg([123])", source.absolute().name)
    if not found:
        fix = "give `camera` camera.yaml; a folder named such as rgbd_dataset_freiburg1_xyz needs none"
        raise InputError(source, "", "has no camera.yaml", fix)
    (fx, fy, cx, cy), distortion = FREIBURG[found[1]]
    keys = {"width": 640, "height": 480, "fx": fx, "fy": fy, "cx": cx, "cy": cy, "depth_scale": 1 / UNITS}
    model = "brown_conrady" if any(distortion) else "pinhole"
    names = {"model": model, "name": f"freiburg{found[1]}", "baseline": KINECT_BASELINE}
    return Camera.model_validate({**names, "distortion": distortion, **keys})
