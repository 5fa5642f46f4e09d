"""Where the gap lies: on the image plane, and on the scene as the camera saw it."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from numpy.typing import NDArray

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.where.localize import Place
from depthsim.gap.depth.where.shares import image_share, region_share
from depthsim.gap.report.figures import SHARE, Picture, figure, png

_VIEWS = 3


def image_picture(evidence: Evidence, places: Sequence[Place], left: Sequence[Place]) -> Picture | None:
    """The share of each cell of the image, before and, where something is ``left``, after."""
    panels = [("before", image_share(evidence, places))]
    if left and left is not places:
        panels.append(("what is left with the causes", image_share(evidence, left)))
    if not panels[0][1].any():
        return None
    most = 100 * float(panels[0][1].max())
    width, height = evidence.camera.width, evidence.camera.height
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


def mesh_picture(evidence: Evidence, places: Sequence[Place]) -> Picture | None:
    """The scene from some of the recording's poses, each region in the colour of its share of the gap."""
    share = region_share(evidence, places)
    if not share.any():
        return None
    chosen = _best_views(evidence, share)
    most = 100 * float(share.max())
    size = evidence.camera.height / evidence.camera.width
    with figure(3.4 * len(chosen) + 0.7, 3.4 * size + 0.35) as drawn:
        axes: list[Axes] = list(drawn.subplots(1, len(chosen), squeeze=False)[0])
        for ax, index in zip(axes, chosen, strict=True):
            ax.imshow(_shaded(evidence, index, 100 * share / most))
            ax.set_title(f"frame {index}", fontweight="normal")
            ax.axis("off")
        scale = ScalarMappable(Normalize(0, most), SHARE)
        drawn.colorbar(scale, ax=axes, label="share of the gap [%]", shrink=0.85)
        regions = int((np.bincount(evidence.cuts.region_of_face) > 0).sum())
        caption = (
            f"The scene as the camera saw it, in {regions} regions of about equal area, coloured by their share of the "
            "gap. `depthsim view` shows the same on the whole mesh."
        )
        return Picture(png(drawn), caption)


def _best_views(evidence: Evidence, share: NDArray[np.float32]) -> list[int]:
    """The frames that together show most of the gap, each added for what the ones before do not show."""
    region = evidence.cuts.region_of_face
    seen = {}
    for index, still in evidence.stills.items():
        face = still.geometry.face[::4, ::4]
        seen[index] = np.bincount(region[face[face >= 0]], minlength=len(share)) / max(face.size, 1)
    covered = np.zeros(len(share))
    chosen: list[int] = []
    for _ in range(min(_VIEWS, len(seen))):
        gains = {
            index: float(share @ (np.minimum(covered + part, 0.2) - np.minimum(covered, 0.2)))
            for index, part in seen.items()
            if index not in chosen
        }
        best = max(gains, key=lambda index: gains[index])
        if chosen and gains[best] <= 0:
            break
        chosen.append(best)
        covered = covered + seen[best]
    return sorted(chosen)


def _shaded(evidence: Evidence, index: int, place: NDArray[np.floating]) -> NDArray[np.float64]:
    """(height, width, 3) the frame's faces in the colours of ``place`` (regions,), darker at a slant."""
    met = evidence.stills[index].geometry
    colours = SHARE(place[evidence.cuts.region_of_face[np.maximum(met.face, 0)]])[..., :3]
    light = 0.7 + 0.3 * np.clip(np.abs(met.cosine), 0, 1)
    return np.where((met.face >= 0)[..., None], colours * light[..., None], 1.0)
