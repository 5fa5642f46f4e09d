"""A run as a data set for training: what torch's DataLoader takes, without torch."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.runs import Run

STREAMS = ("clean", "rgb", "material", "normal", "mask")


class DepthDataset:
    """A map-style data set over one run or several: ``len``, and an item a frame.

    torch's ``DataLoader(DepthDataset(paths), batch_size=8, num_workers=4)`` works as it is: an item is a dict of arrays
    that the default collate function stacks. All runs must have one picture size for that.

    paths: run folders. streams: what to read besides depth, of :data:`STREAMS`; a run without one is an error.

    Items: ``depth`` (1, height, width) float32 [m], 0 is a hole; ``clean`` likewise; ``rgb`` (C, height, width)
    float32 from 0 to 1; ``material`` (height, width) int64; ``normal`` (3, height, width) float32, world;
    ``mask`` (1, height, width) bool; ``pose`` (4, 4) float64, camera to world; ``K`` (3, 3) float64; ``stamp`` float
    [s]; ``run`` and ``frame``, the numbers of both.

    Raises :class:`InputError` as :class:`~depthsim.runs.Run` does.
    """

    def __init__(self, paths: str | Path | list[str | Path], streams: tuple[str, ...] = ()) -> None:
        from depthsim.errors import InputError

        self.streams = tuple(streams)
        if unknown := set(streams) - set(STREAMS):
            raise ValueError(f"streams are some of {STREAMS}, not {sorted(unknown)}")
        self.runs = [Run.open(Path(path)) for path in ([paths] if isinstance(paths, str | Path) else paths)]
        for run in self.runs:
            for stream in self.streams:
                if not run.has(stream):
                    raise InputError(run.path, stream, "is not there for every frame", "leave that stream out")
        self._ends = np.cumsum([len(run) for run in self.runs])

    def __len__(self) -> int:
        return int(self._ends[-1]) if self.runs else 0

    def __getitem__(self, item: int) -> dict[str, Any]:
        if not -len(self) <= item < len(self):
            raise IndexError(item)
        item %= len(self)
        number = int(np.searchsorted(self._ends, item, side="right"))
        run = self.runs[number]
        frame = item - int(self._ends[number]) + len(run)
        camera = run.camera
        sample: dict[str, Any] = {
            "depth": run.depth(frame)[None],
            "pose": run.poses[frame].copy(),
            "K": np.array([[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]),
            "stamp": float(run.stamps[frame]),
            "run": number,
            "frame": frame,
        }
        return sample | {stream: _picture(run, stream, frame) for stream in self.streams}


def _picture(run: Run, stream: str, frame: int) -> NDArray[Any]:
    """One picture with its channels first."""
    picture = getattr(run, stream)(frame)
    if stream in ("clean", "mask"):
        return np.asarray(picture[None])
    if stream == "material":
        return np.asarray(picture.astype(np.int64))
    if stream == "normal":
        return np.ascontiguousarray(picture.transpose(2, 0, 1))
    image = picture[None] if picture.ndim == 2 else picture.transpose(2, 0, 1)
    return np.ascontiguousarray(image, dtype=np.float32) / np.float32(255)
