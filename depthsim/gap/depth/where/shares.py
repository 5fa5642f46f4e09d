"""Where the gap lies on the scene and in the image, as arrays for pictures and for the viewer."""

import io
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from depthsim.gap.depth.data.evidence import Evidence
from depthsim.gap.depth.data.histograms import ERROR
from depthsim.gap.depth.where.localize import Place

Shares = NDArray[np.float32]
_ROWS, _COLUMNS = 12, 16


def region_share(evidence: Evidence, places: Sequence[Place]) -> Shares:
    """(regions,) each region's share of the gap; zeros without a gap."""
    return _along(evidence, places, "surface", int(evidence.cuts.region_of_face.max()) + 1)


def face_share(evidence: Evidence, places: Sequence[Place]) -> Shares:
    """(faces,) each face's share of the gap: its region's, by area."""
    region, areas = evidence.cuts.region_of_face, evidence.scene.areas
    of_region = np.bincount(region, areas)
    part = areas / np.maximum(of_region[region], 1e-12)
    return (region_share(evidence, places)[region] * part).astype(np.float32)


def image_share(evidence: Evidence, places: Sequence[Place]) -> Shares:
    """(12, 16) the share of the gap of each cell of the image plane; zeros without a gap."""
    return _along(evidence, places, "image_position", _ROWS * _COLUMNS).reshape(_ROWS, _COLUMNS)


def shares_npz(evidence: Evidence, places: Sequence[Place]) -> bytes:
    """The bytes of where.npz: ``face_share`` and ``image_share``."""
    out = io.BytesIO()
    np.savez_compressed(out, face_share=face_share(evidence, places), image_share=image_share(evidence, places))
    return out.getvalue()


def _along(evidence: Evidence, places: Sequence[Place], name: str, size: int) -> Shares:
    for place in places:
        axis = evidence.axes[place.axis]
        if (axis.name, axis.kind, axis.size, axis.single) == (name, ERROR, size, True):
            return place.shares.astype(np.float32)
    return np.zeros(size, np.float32)
