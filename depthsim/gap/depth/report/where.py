"""Where the gap lies on the image and on the scene, as arrays that are drawn."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.where.localize import Place
from depthsim.gap.depth.where.shares import image_share, region_share
from depthsim.gap.report.drawing import Array, Drawn

_FRAMES = 3


class ImageShare(Drawn):
    """Each cell's share of the gap, over an image of width x height [px]; left: of what the causes leave."""

    width: int
    height: int
    before: Array
    left: Array | None


class MeshFrame(Drawn):
    """A frame. region: (height, width) of each pixel, -1 for none; light: (height, width) 0 to 255."""

    index: int
    region: Array
    light: Array


class MeshShare(Drawn):
    """The scene by region. share: (regions,) of the gap."""

    share: Array
    regions: int
    frames: tuple[MeshFrame, ...]


def image_shares(evidence: Evidence, places: Sequence[Place], left: Sequence[Place]) -> ImageShare | None:
    """The share of each cell of the image, before and, where something is ``left``, after."""
    before = image_share(evidence, places)
    if not before.any():
        return None
    after = image_share(evidence, left) if left and left is not places else None
    return ImageShare(width=evidence.camera.width, height=evidence.camera.height, before=before, left=after)


def mesh_share(evidence: Evidence, places: Sequence[Place]) -> MeshShare | None:
    """The scene from some of the recording's poses, by region."""
    share = region_share(evidence, places)
    if not share.any():
        return None
    frames = tuple(_frame(evidence, index) for index in _best_frames(evidence, share))
    regions = int((np.bincount(evidence.cuts.region_of_face) > 0).sum())
    return MeshShare(share=share, regions=regions, frames=frames)


def _frame(evidence: Evidence, index: int) -> MeshFrame:
    frame = evidence.frames[index]
    met = evidence.caster.cast(evidence.camera, frame.pose, stamps=frame.stamp, threads=evidence.threads)
    region = evidence.cuts.region_of_face[np.maximum(met.face, 0)]
    light = 0.7 + 0.3 * np.clip(np.abs(met.cosine), 0, 1)
    return MeshFrame(
        index=index,
        region=np.where(met.face >= 0, region, -1).astype(np.int8 if region.max() < 128 else np.int16),
        light=np.rint(255 * light).astype(np.uint8),
    )


def _best_frames(evidence: Evidence, share: NDArray[np.float32]) -> list[int]:
    """The frames that together show most of the gap, each added for what the ones before do not show."""
    region = evidence.cuts.region_of_face
    seen = {}
    for index, frame in evidence.frames.items():
        face = frame.geometry.face[::4, ::4]
        seen[index] = np.bincount(region[face[face >= 0]], minlength=len(share)) / max(face.size, 1)
    covered = np.zeros(len(share))
    selected: list[int] = []
    for _ in range(min(_FRAMES, len(seen))):
        gains = {
            index: float(share @ (np.minimum(covered + part, 0.2) - np.minimum(covered, 0.2)))
            for index, part in seen.items()
            if index not in selected
        }
        best = max(gains, key=lambda index: gains[index])
        if selected and gains[best] <= 0:
            break
        selected.append(best)
        covered = covered + seen[best]
    return sorted(selected)
