"""Fewer pixels than were measured: blocks of them become one."""

import numpy as np

from benchmarks.withheld_data.film import Film, Floats, Formula, Rng, Take


class _Blocks(Formula):
    """amount: side of the blocks [px], rounded. The pictures are those of a camera with so many more pixels, of which
    no D400 has more than 1280 x 720.
    """

    statistic = "pooled"
    span = (1.0, 4.4)

    def __init__(self, rng: Rng, film: Film) -> None:
        self.least = float(rng.uniform(0.0, 0.5))
        room = min(1280 // film.camera.width, 720 // film.camera.height)
        self.span = (self.span[0], min(self.span[1], room + 0.4))
        self._films: dict[tuple[Film, int], Film] = {}
        self._made: dict[tuple[Film, int, int], Floats] = {}

    def known(self) -> dict[str, float]:
        """The side means the same."""
        return {"factor": self.side}

    @property
    def side(self) -> int:
        """The amount as a whole number."""
        return round(self.amount)

    def finish(self, take: Take) -> None:
        """Film with more pixels and make them fewer. Intrinsics are those that are told, times the side."""
        key = take.film, self.side, take.index
        if key not in self._made:
            self._made[key] = self._of_blocks(*key)
        take.z = self._made[key].copy()

    def _of_blocks(self, film: Film, k: int, index: int) -> Floats:
        own, shape = film.camera, film.camera.shape
        if (film, k) not in self._films:
            size = {"width": own.width * k, "height": own.height * k}
            camera = own.model_copy(update=size | {name: getattr(own, name) * k for name in ("fx", "fy", "cx", "cy")})
            self._films[film, k] = Film(film.world, film.route, camera, film.stamps, film.base, film.seed)
        z = self._films[film, k].make(index, ()).z
        blocks = z.reshape(shape[0], k, shape[1], k).swapaxes(1, 2).reshape(*shape, k * k)
        there = (blocks > 0).sum(axis=-1) > self.least * k * k
        return np.where(there, self.pooled(film, blocks), 0)

    def pooled(self, film: Film, blocks: Floats) -> Floats:
        """(height, width) one depth of (height, width, pixels of a block); 0 is a hole, and arbitrary where all are."""
        raise NotImplementedError


class MeanOfInverse(_Blocks):
    """The mean of the disparities in a block, where more than a share of it has depth."""

    effect = "decimation"

    def pooled(self, film: Film, blocks: Floats) -> Floats:
        """Of the pixels with depth."""
        d = film.inverse(blocks)
        return film.inverse(d.sum(axis=-1) / np.maximum((d > 0).sum(axis=-1), 1))


class MiddleOfBlock(_Blocks):
    """The median of the depths in a block, of an even number halfway between the two in the middle."""

    effect = "decimation"

    def pooled(self, film: Film, blocks: Floats) -> Floats:
        """Of the pixels with depth."""
        ranked = np.sort(np.where(blocks > 0, blocks, np.inf), axis=-1)
        count = (blocks > 0).sum(axis=-1, keepdims=True)
        both = [np.take_along_axis(ranked, np.maximum(count - 1 + n, 0) // 2, axis=-1) for n in (0, 1)]
        return np.where(count[..., 0] > 0, (both[0] + both[1])[..., 0] / 2, 0)
