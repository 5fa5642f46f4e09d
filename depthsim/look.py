"""What a mesh file says of its surfaces' colours: textures, and colours of the corners of faces."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.yamlfile import beside

PLAIN, PROCEDURAL = -1, -2
"""In place of a texture: the corners' colours alone; and no colours at all, so that the material's have to do."""
MOST_ACROSS, MOST_TEXELS = 16_384, 134_217_728
"""[px] The size that a texture may have, and all of a scene together: 0.5 GB in memory."""
_SMALLER = "make it smaller, or write no colour (`only_depth`)"


@dataclass(frozen=True)
class Texture:
    """A picture that a mesh file names or holds; it is read when colours are asked for.

    file, place: where the mesh file names it. name: of its own file, in the mesh file's folder; data: its bytes, where
    the mesh file holds them. problem: why neither can be had.
    """

    file: Path
    place: str
    name: str = ""
    data: bytes | None = None
    problem: str = ""

    def size(self) -> tuple[int, int]:
        """(width, height) [px], from the picture's head. Raises :class:`InputError` as :meth:`read` does."""
        from PIL import Image

        try:
            with Image.open(self._source()) as picture:
                width, height = picture.size
        except InputError:
            raise
        except Exception as error:
            raise self._unreadable(error) from None
        if max(width, height) > MOST_ACROSS:
            raise self._error(f"is {width}x{height}, and at most {MOST_ACROSS} px across are read", _SMALLER)
        return width, height

    def read(self) -> NDArray[np.uint8]:
        """(height, width, 3) uint8. Raises :class:`InputError` for a texture that is missing, huge or no picture."""
        from PIL import Image

        self.size()
        limit, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None  # ours is checked
        try:
            with Image.open(self._source()) as picture:
                return np.asarray(picture.convert("RGB"), np.uint8)
        except Exception as error:
            raise self._unreadable(error) from None
        finally:
            Image.MAX_IMAGE_PIXELS = limit

    def _source(self) -> Path | BytesIO:
        if self.problem:
            raise self._error(self.problem, "export it with textures as PNG or JPEG")
        if self.data is not None:
            return BytesIO(self.data)
        path = beside(self.file, self.name.replace("\\", "/"), self.place)
        if not path.is_file():
            fix = "put it there, or write no colour (`only_depth`)"
            raise self._error(f"names the texture {self.name}, which is not there", fix)
        return path

    def _unreadable(self, error: Exception) -> InputError:
        what = self.name or "the texture"
        return self._error(f"{what} is no readable picture ({type(error).__name__})", "export it as PNG or JPEG")

    def _error(self, problem: str, fix: str) -> InputError:
        return InputError(self.file, self.place, problem, fix)


@dataclass(frozen=True)
class Look:
    """The colours of a mesh, face by face.

    texture: (F,) int32 places in ``textures``, PLAIN or PROCEDURAL. uv: (F, 3, 2) float32 places of the corners in the
    texture, from its lower left corner, which is (0, 0), to its upper right one, (1, 1); beyond that it is repeated.
    colors: (F, 3, 3) uint8 RGB of the corners, which the texture is multiplied by.
    """

    texture: NDArray[np.int32]
    uv: NDArray[np.float32]
    colors: NDArray[np.uint8]
    textures: tuple[Texture, ...] = ()

    @classmethod
    def none(cls, faces: int) -> "Look":
        """Of faces without colours of their own."""
        white = np.full((faces, 3, 3), 255, np.uint8)
        return cls(np.full(faces, PROCEDURAL, np.int32), np.zeros((faces, 3, 2), np.float32), white)

    def __getitem__(self, faces: NDArray[np.bool_]) -> "Look":
        """That of some of the faces."""
        return Look(self.texture[faces], self.uv[faces], self.colors[faces], self.textures)

    def turned_over(self) -> "Look":
        """That of faces whose corners are listed the other way round."""
        return Look(self.texture, self.uv[:, ::-1], self.colors[:, ::-1], self.textures)

    def compact(self) -> "Look":
        """The same without the textures that no face has."""
        used = [int(k) for k in np.unique(self.texture) if k >= 0]
        place = np.full(len(self.textures) + 2, 0, np.int32)
        place[[PLAIN, PROCEDURAL]] = PLAIN, PROCEDURAL
        place[used] = np.arange(len(used))
        return Look(place[self.texture], self.uv, self.colors, tuple(self.textures[k] for k in used))

    @cached_property
    def pictures(self) -> tuple[NDArray[np.uint8], ...]:
        """The textures that faces have, read; an empty one for others. Raises :class:`InputError`."""
        used = [int(k) for k in np.unique(self.texture) if k >= 0]
        total = 0
        for k in used:
            width, height = self.textures[k].size()
            total += width * height
            if total > MOST_TEXELS:
                one, problem = self.textures[k], f"and the others have over {MOST_TEXELS:,} px together"
                raise InputError(one.file, one.place, f"this texture, {width}x{height}, {problem}", _SMALLER)
        empty = np.zeros((1, 1, 3), np.uint8)
        return tuple(one.read() if k in used else empty for k, one in enumerate(self.textures))


def joined(looks: Sequence[Look | None], faces: Sequence[int]) -> Look | None:
    """The look of several meshes in a row, of so many faces each; None where none of them has one."""
    if not any(looks):
        return None
    every = [look or Look.none(count) for look, count in zip(looks, faces, strict=True)]
    begin = np.cumsum([0, *(len(look.textures) for look in every)])
    texture = [np.where(o.texture >= 0, o.texture + k, o.texture) for o, k in zip(every, begin[:-1], strict=True)]
    return Look(
        np.concatenate(texture).astype(np.int32),
        np.concatenate([one.uv for one in every]),
        np.concatenate([one.colors for one in every]),
        tuple(texture for one in every for texture in one.textures),
    )
