"""The matcher's presets on real infrared pairs, beside the depth that the camera's own chip gave for them.

    ./run python benchmarks/stereo_presets.py PAIR [PAIR ...] [--colour 0.0174]

A PAIR is a folder of left.png and right.png, rectified, camera.yaml of the two, and depth.png, the chip's depth in the
left imager's view in units of the camera's depth_scale, of any size. Such pairs are published by others and are not
here; docs/sensors.md says what its table was made of. Depth that was aligned to the colour camera and back has no depth
where that camera sees something nearer: `--colour` says how far [m] to the left of the left imager it stands, and what
it cannot see is left out.
"""

import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import ndimage

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from depthsim.camera import read_camera
from depthsim.runs.png import decode_png
from depthsim.stereo.matcher import Matcher
from depthsim.stereo.presets import CHIP
from depthsim.stereo.settings import MatcherSettings

Floats = NDArray[np.float32]


def beside_the_chip(found: Floats, chip: Floats, hidden: NDArray[np.bool_] | None = None) -> dict[str, float]:
    """Shares [%] of (height, width) disparities [px]; 0 or less where there is none. hidden: no holes of the chip's."""
    ours, theirs = found > 0, chip > 0
    both, off, empty = ours & theirs, np.abs(found - chip), holes_of(theirs)
    if hidden is not None:
        empty = empty & ~hidden
    return {
        "filled where the chip is empty": 100 * float(ours[empty].mean()) if empty.any() else 0.0,
        "empty where it is not": 100 * float(1 - ours[theirs].mean()),
        "within 0.5 px, of the chip's": 100 * float((both & (off < 0.5)).sum() / theirs.sum()),
        "beyond 2 px, of both": 100 * float((both & (off > 2)).sum() / max(both.sum(), 1)),
    }


def holes_of(valid: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pixels that the chip lost: not the cracks of depth that was resampled, nor what a colour camera has not seen."""
    labels, _ = ndimage.label(~ndimage.binary_closing(np.pad(valid, 4), np.ones((5, 5)))[4:-4, 4:-4])
    border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
    return np.asarray((labels > 0) & ~np.isin(labels, border))


def hidden_from(disparity: Floats, share: float) -> NDArray[np.bool_]:
    """Where a camera ``share`` of the baseline to the left of the left imager sees something nearer.

    disparity: (height, width) [px]; a hole is taken for the farther of what lies beside it in its row.
    """
    valid, columns = disparity > 0, np.arange(disparity.shape[1])
    before = np.maximum.accumulate(np.where(valid, columns, -1), axis=1)
    after = np.minimum.accumulate(np.where(valid, columns, columns.size)[:, ::-1], axis=1)[:, ::-1]
    ends = np.pad(disparity, ((0, 0), (1, 1)), constant_values=np.inf)
    farther = np.minimum(*(np.take_along_axis(ends, beside + 1, axis=1) for beside in (before, after)))
    # Hidden is what stands left of something in the other camera that is left of it here.
    seen_at = columns + share * np.where(np.isfinite(farther), farther, 0)
    return np.asarray(np.maximum.accumulate(seen_at, axis=1) > seen_at + 0.5)


def read_pair(folder: Path) -> tuple[NDArray[np.integer], NDArray[np.integer], Floats, float]:
    """Left, right, the chip's disparity [px of the pair] at its own pixels, and the baseline [m]."""
    camera, units = read_camera(folder / "camera.yaml"), decode_png(folder / "depth.png")
    depth = units.astype(np.float32) * np.float32(camera.depth_scale)
    chip = np.divide(np.float32(camera.focal_baseline), depth, out=np.zeros_like(depth), where=units > 0)
    return decode_png(folder / "left.png"), decode_png(folder / "right.png"), chip, camera.baseline


def at_pixels_of(picture: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """The nearest values for pictures of another size."""
    rows, columns = (
        ((np.arange(count) + 0.5) * size / count).astype(int) for size, count in zip(picture.shape, shape, strict=True)
    )
    return np.asarray(picture[np.ix_(rows, columns)])


def main(
    pairs: Annotated[list[Path], typer.Argument(help="Folders of one pair each.")],
    colour: Annotated[float, typer.Option(help="How far left of the left imager the colour camera is [m].")] = 0.0,
) -> None:
    """Print the mean of the pairs for each preset."""
    table = Table("preset", *beside_the_chip(np.ones((1, 1), np.float32), np.ones((1, 1), np.float32)))
    read = [read_pair(folder) for folder in pairs]
    for name in CHIP:
        matcher, rows = Matcher(MatcherSettings(preset=name)), []
        for left, right, chip, baseline in read:
            found = matcher.match(left, right)
            # The band at the left has no match, and the chip's own was cut off before some were published.
            inner = np.s_[:, chip.shape[1] // 8 :]
            hidden = at_pixels_of(hidden_from(found, colour / baseline), chip.shape)[inner] if colour else None
            ours = at_pixels_of(found, chip.shape)[inner]
            rows.append(list(beside_the_chip(ours, chip[inner], hidden).values()))
        table.add_row(name, *(f"{value:.1f} %" for value in np.mean(rows, axis=0)))
    Console(width=120).print(table)


if __name__ == "__main__":
    typer.run(main)
