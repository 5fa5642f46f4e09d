"""`depthsim match`: depth from a rectified pair of images."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.errors import InputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


def match(
    left: Annotated[Path, typer.Argument(help="PNG of the left imager, rectified: 8 or 16 bits, grey.")],
    right: Annotated[Path, typer.Argument(help="PNG of the right imager, of the same size.")],
    camera: Annotated[Path, typer.Option(help="The camera.yaml of the pair.")],
    out: Annotated[Path, typer.Option(help="The depth, a 16-bit PNG in units of the camera's depth_scale.")],
    settings: Annotated[Path | None, typer.Option(help="YAML with what the matcher should do differently.")] = None,
    preset: Annotated[
        str | None, typer.Option(help="default, high_accuracy, high_density or medium_density, as on a D400.")
    ] = None,
    threads: Annotated[int | None, typer.Option(min=1, help="Threads. [default: all cores]")] = None,
) -> None:
    """Match a real or simulated pair as the active stereo sensor does, and write the depth of the left image."""
    from depthsim.camera import read_camera
    from depthsim.runs.png import encode_png
    from depthsim.runs.storing import write_whole
    from depthsim.stereo.matcher import Matcher, to_depth
    from depthsim.stereo.presets import CHIP
    from depthsim.stereo.settings import MatcherSettings
    from depthsim.units import to_depth_raw
    from depthsim.yamlfile import read_model

    eye = read_camera(camera)
    if any(eye.distortion):
        raise InputError(camera, "distortion", "is not zero, so the pair is not rectified", "rectify images and camera")
    if out.suffix.lower() != ".png":
        raise InputError(out, "", "is not the name of a PNG", "give --out a name that ends in .png")
    pair = _grey(left, eye.shape, camera), _grey(right, eye.shape, camera)
    if pair[0].dtype != pair[1].dtype:
        raise InputError(right, "", f"has not as many bits as {left}", "give two images of one kind")
    if preset is not None and settings is not None:
        raise InputError("--preset", preset, "stands beside --settings", f"write preset: {preset} into {settings}")
    if preset is not None and preset not in CHIP:
        raise InputError("--preset", preset, "is no preset", f"name one of {', '.join(CHIP)}")
    if settings is not None:
        how = read_model(MatcherSettings, settings, "the matcher's settings")
    else:
        how = MatcherSettings.model_validate({"preset": preset or "default"})
    depth = to_depth(Matcher(how).match(*pair, threads=threads), eye.focal_baseline)
    write_whole(out, encode_png(to_depth_raw(depth, eye)))
    found = depth[depth > 0]
    # NumPy's median imports masked arrays: 0.03 s.
    found.partition(found.size // 2)
    range_ = f", {found.min():.2f} to {found.max():.2f} m, median {found[found.size // 2]:.2f} m" if found.size else ""
    print(f"{out}: {100 * found.size / depth.size:.1f} % of the pixels have depth{range_}")


def _grey(path: Path, shape: tuple[int, int], camera: Path) -> "NDArray[np.uint8] | NDArray[np.uint16]":
    """A grey image; three equal channels count as one."""
    from depthsim.runs.png import decode_png

    image = decode_png(path)
    if image.ndim == 3:
        if (image != image[..., :1]).any():
            raise InputError(path, "", "is a colour image", "give the grey image of an infrared imager")
        image = image[..., 0].copy()
    if image.shape != shape:
        size, wanted = f"{image.shape[1]}x{image.shape[0]}", f"{shape[1]}x{shape[0]}"
        raise InputError(path, "", f"is {size}, but {camera} has {wanted}", "give the camera of these images")
    return image
