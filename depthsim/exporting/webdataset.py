"""WebDataset shards: shard-000000.tar and on, for training from disk or over a network.

A sample is a group of files of one name: NUMBER.depth.png (16 bit), .clean.png, .rgb.png and .mask.png where the run
has them, and NUMBER.json with stamp, pose (4x4, camera to world, row by row), K (3x3), distortion, baseline and
depth_scale. The same run gives the same bytes.
Source: the WebDataset format, https://github.com/webdataset/webdataset.
"""

import io
import json
import tarfile
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.exporting.options import ExportOptions
from depthsim.runs import Run
from depthsim.runs.png import encode_png


def write(run: Run, out: Path, options: ExportOptions) -> str:
    """Write the shards; says how many."""
    if options.shard < 1:
        raise InputError("`shard`", str(options.shard), "is not a number of frames", "give 1 or more")
    streams = [stream for stream in ("clean", "rgb", "mask") if run.has(stream)]
    starts = range(0, len(run), options.shard)
    for number, start in enumerate(starts):
        with tarfile.open(out / f"shard-{number:06d}.tar", "w", format=tarfile.USTAR_FORMAT) as tar:
            for index in range(start, min(start + options.shard, len(run))):
                for suffix, data in _sample(run, index, streams).items():
                    entry = tarfile.TarInfo(f"{index:06d}.{suffix}")
                    entry.size = len(data)
                    tar.addfile(entry, io.BytesIO(data))
    return f"{len(run)} samples in {len(starts)} shards"


def _sample(run: Run, index: int, streams: list[str]) -> dict[str, bytes]:
    camera = run.camera
    keys = {
        "stamp": float(run.stamps[index]),
        "pose": run.poses[index].tolist(),
        "K": [[camera.fx, 0.0, camera.cx], [0.0, camera.fy, camera.cy], [0.0, 0.0, 1.0]],
        "distortion": list(camera.distortion),
        "baseline": camera.baseline,
        "depth_scale": camera.depth_scale,
    }
    files = {"depth.png": encode_png(run.depth_raw(index))}
    for stream in streams:
        files[f"{stream}.png"] = encode_png(_picture(run, stream, index))
    return files | {"json": json.dumps(keys).encode()}


def _picture(run: Run, stream: str, index: int) -> NDArray[np.uint8] | NDArray[np.uint16]:
    if stream == "clean":
        clean = run.clean(index)
        assert clean is not None
        return np.rint(clean / run.camera.depth_scale).astype(np.uint16)
    if stream == "mask":
        mask = run.mask(index)
        assert mask is not None
        return mask.astype(np.uint8) * np.uint8(255)
    image = run.rgb(index)
    assert image is not None
    return image
