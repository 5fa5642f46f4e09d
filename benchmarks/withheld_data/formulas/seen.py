"""What a film sees: its ranges and materials, for formulas whose parameters must fit the scene."""

import numpy as np

from benchmarks.withheld_data.film import Film, Floats, Mask, Rng, Take


def ranges(film: Film) -> Floats:
    """(1001,) the range that 0, 1 ... 1000 thousandths of what is seen do not reach [m]."""
    depths = np.concatenate([film.make(index, (), noise=False).z.ravel()[::5] for index in _some(film)])
    return np.quantile(depths[depths > 0], np.linspace(0, 1, 1001)) if (depths > 0).any() else np.ones(1001)


def draw_tag(rng: Rng, film: Film, least: float) -> str:
    """A material that fills ``least`` to 0.8 of the pixels, any of them alike; any at all where there is none."""
    tags = np.concatenate([film.make(index, (), noise=False).geometry.tag.ravel()[::5] for index in _some(film)])
    share = np.bincount(tags, minlength=256)[: len(film.world.scene.tags)] / tags.size
    fits = [tag for tag, part in zip(film.world.scene.tags, share, strict=True) if least <= part <= 0.8]
    return str(rng.choice(fits or film.world.scene.tags))


def of_tag(take: Take, tag: str) -> Mask:
    """(height, width) where a material is met."""
    return np.asarray(take.geometry.tag == take.film.world.scene.tags.index(tag))


def _some(film: Film) -> range:
    return range(0, len(film), max(1, len(film) // 6))
