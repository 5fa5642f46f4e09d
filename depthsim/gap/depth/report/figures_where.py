"""Where the gap lies: on the image plane, and on the scene as the camera saw it."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from depthsim.gap.depth.report.where import ImageShare, MeshFrame, MeshShare
from depthsim.gap.report.figures import SHARE, Picture, figure, png


def image_picture(image: ImageShare) -> Picture:
    """The share of each cell of the image, before and, where something is left, after."""
    panels = [("before", image.before)]
    if image.left is not None:
        panels.append(("what is left with the causes", image.left))
    most = 100 * float(panels[0][1].max())
    width, height = image.width, image.height
    with figure(4.8 * len(panels) + 0.6, 4.5 * height / width + 0.7) as drawn:
        axes: list[Axes] = list(drawn.subplots(1, len(panels), squeeze=False)[0])
        for ax, (title, share) in zip(axes, panels, strict=True):
            extent = (0, width, height, 0)
            picture = ax.imshow(100 * share, cmap=SHARE, vmin=0, vmax=most, extent=extent, aspect="equal")
            ax.set(title=title if len(panels) > 1 else "", xlabel="image column [px]", ylabel="image row [px]")
        drawn.colorbar(picture, ax=axes, label="share of the gap [%]", shrink=0.85)
        even = 100 / panels[0][1].size
        caption = f"The image plane by share of the gap. Spread evenly, each cell would have {even:.1f} %."
        return Picture(png(drawn), caption)


def mesh_picture(mesh: MeshShare) -> Picture:
    """The scene from some of the recording's poses, each region in the colour of its share of the gap."""
    most = 100 * float(mesh.share.max())
    height, width = mesh.frames[0].region.shape
    size = height / width
    with figure(3.4 * len(mesh.frames) + 0.7, 3.4 * size + 0.35) as drawn:
        axes: list[Axes] = list(drawn.subplots(1, len(mesh.frames), squeeze=False)[0])
        for ax, frame in zip(axes, mesh.frames, strict=True):
            ax.imshow(_shaded(frame, 100 * mesh.share / most))
            ax.set_title(f"frame {frame.index}", fontweight="normal")
            ax.axis("off")
        scale = ScalarMappable(Normalize(0, most), SHARE)
        drawn.colorbar(scale, ax=axes, label="share of the gap [%]", shrink=0.85)
        caption = (
            f"The scene as the camera saw it, in {mesh.regions} regions of about equal area, coloured by their share "
            "of the gap. `depthsim view` shows the same on the whole mesh."
        )
        return Picture(png(drawn), caption)


def _shaded(frame: MeshFrame, place: NDArray[np.floating]) -> NDArray[np.float64]:
    """(height, width, 3) the frame's faces in the colours of ``place`` (regions,), darker at a slant."""
    colours = SHARE(place[np.maximum(frame.region, 0)])[..., :3]
    return np.where((frame.region >= 0)[..., None], colours * (frame.light / 255)[..., None], 1.0)
