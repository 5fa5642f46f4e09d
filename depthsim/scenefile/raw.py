"""What every mesh reader returns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from depthsim.look import Look


@dataclass(frozen=True)
class RawMesh:
    """Triangles as a file has them, unchecked.

    vertices: (V, 3) float64, in the file's units and axes.
    faces: (F, 3) int64 indices into ``vertices``, counter-clockwise seen from outside.
    names: the material names of the file; "" stands for a face without a material.
    face_names: (F,) int64 indices into ``names``.
    look: the colours of the faces, where the file has any.
    """

    vertices: NDArray[np.float64]
    faces: NDArray[np.int64]
    names: tuple[str, ...]
    face_names: NDArray[np.int64]
    look: Look | None = None

    @property
    def areas(self) -> NDArray[np.float64]:
        """(F,) areas of the faces, in square units."""
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        return np.asarray(np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2)


def wound_outwards(faces: NDArray[np.int64], matrix: NDArray[np.float64]) -> NDArray[np.int64]:
    """The faces, turned back if the (3, 3) matrix that their vertices go through mirrors."""
    return faces[:, ::-1] if np.linalg.det(matrix) < 0 else faces
