"""What a cast returns: pictures of the clean geometry."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from depthsim.scene import Scene

NO_FACE = -1


@dataclass
class Geometry:
    """Clean geometry seen from N poses; every picture is (N, height, width), or (height, width) for one pose.

    depth: float32 z-depth along the optical axis [m]; 0 where nothing is hit.
    face: int32 index of the face; -1 where nothing is hit.
    cosine: float32 cosine of the angle between ray and surface normal, 0 to 1; 0 where nothing is hit.
    tag: uint8 index into Scene.tags; 255 where nothing is hit.
    right_sees: uint8, 1 where no surface hides the point from the right imager, 0 where one does and where nothing is
        hit; None where it was not asked for.
        Points that leave the right image at its border count as seen: that band is an effect of its own.
    kept: what was made of these pictures last, by name and numbers, where many sensors see them; None where they are
        written over.
    """

    depth: NDArray[np.float32]
    face: NDArray[np.int32]
    cosine: NDArray[np.float32]
    tag: NDArray[np.uint8]
    right_sees: NDArray[np.uint8] | None = None
    kept: dict[str, dict[tuple[float, ...], NDArray[Any]]] | None = field(default=None, repr=False, compare=False)

    def once(self, name: str, of: tuple[float, ...], make: Callable[[], NDArray[Any]], room: int = 0) -> NDArray[Any]:
        """What ``make`` makes of these pictures alone, with the numbers ``of``; made once where that is kept.

        room: [bytes] for what was made with other numbers before; what was asked for last is kept without.
        """
        if self.kept is None:
            return make()
        known = self.kept.setdefault(name, {})
        found = known.pop(of, None)
        if found is None:
            found = make().copy()
            for oldest in list(known)[: max(0, len(known) - room // max(found.nbytes, 1))]:
                known.pop(oldest, None)  # another thread may have let go of it
        known[of] = found
        return found

    @classmethod
    def empty(cls, shape: tuple[int, ...], right: bool) -> "Geometry":
        """Pictures for a cast to write; what stands in them until then is arbitrary."""
        return cls(
            depth=np.empty(shape, np.float32),
            face=np.empty(shape, np.int32),
            cosine=np.empty(shape, np.float32),
            tag=np.empty(shape, np.uint8),
            right_sees=np.empty(shape, np.uint8) if right else None,
        )

    def __getitem__(self, index: int) -> "Geometry":
        """The pictures of one pose; they share memory with this object."""
        right = None if self.right_sees is None else self.right_sees[index]
        return Geometry(self.depth[index], self.face[index], self.cosine[index], self.tag[index], right)

    def reshaped(self, shape: tuple[int, ...]) -> "Geometry":
        """The same pictures under another shape; they share memory with this object."""
        right = None if self.right_sees is None else self.right_sees.reshape(shape)
        return Geometry(
            self.depth.reshape(shape),
            self.face.reshape(shape),
            self.cosine.reshape(shape),
            self.tag.reshape(shape),
            right,
        )

    @property
    def hit(self) -> NDArray[np.bool_]:
        """Where a ray hit something."""
        return self.face != NO_FACE

    def normals(self, scene: Scene, stamp: float = 0.0) -> NDArray[np.float32]:
        """Unit geometric normals in the world, float32 with a last axis of 3, as the winding has them; 0 = no hit.

        stamp: when, for objects that move [s].
        """
        return np.where(self.hit[..., None], scene.normals_at(stamp)[np.maximum(self.face, 0)], np.float32(0))
