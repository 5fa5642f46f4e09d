"""Which cases a tier has, in an order whose beginning is spread over all effects and strengths."""

import itertools
from collections.abc import Iterator

import numpy as np

from benchmarks.withheld_data.axes import RIGHT_AXES
from benchmarks.withheld_data.case import Wanted
from benchmarks.withheld_data.formulas import FORMULAS, OUTSIDE
from benchmarks.withheld_data.strength import STRENGTHS

TIERS = {
    "a": "one effect withheld from the simulator",
    "b": "withheld from the bank as well",
    "c": "two and three effects",
    "d": "none",
    "e": "active stereo as the real camera",
    "f": "real D435 frames",
    "speed": "40 frames of 424x240, whole bank",
}
_APART = ({"material_noise", "disparity_noise"}, {"spatial_correlation", "temporal_correlation"})
"""Effects that hide one another: no case has both."""
_ALIKE_IN_MOTION = {"time_offset", "extrinsic_rotation", "extrinsic_translation", "rolling_shutter"}
"""Of these a case has at most one."""


def planned(tier: str) -> Iterator[Wanted]:
    """The cases of a tier, without an end but for f and speed."""
    makers = {"a": _one, "b": _withheld, "c": _several, "d": _none, "e": _active, "speed": _speed}
    if tier not in makers:
        raise ValueError(f"tier {tier!r} has no plan; the tiers are {', '.join(TIERS)}")
    yield from makers[tier]()


def _one() -> Iterator[Wanted]:
    for seed in itertools.count():
        pairs = list(itertools.product(FORMULAS, STRENGTHS))
        for at in np.random.default_rng(seed).permutation(len(pairs)):
            effect, strength = pairs[at]
            yield Wanted("a", (effect,), (strength,), seed)


def _withheld() -> Iterator[Wanted]:
    for seed in itertools.count():
        rng = np.random.default_rng(1000 + seed)
        effects = [*RIGHT_AXES, *OUTSIDE]
        for at in rng.permutation(len(effects)):
            yield Wanted("b", (effects[at],), (str(rng.choice(STRENGTHS[1:])),), seed)


def _several() -> Iterator[Wanted]:
    for seed in itertools.count():
        rng = np.random.default_rng(2000 + seed)
        while True:
            count = 2 + int(rng.random() < 0.4)
            effects = tuple(map(str, rng.choice(list(FORMULAS), count, replace=False)))
            apart = not any(pair <= set(effects) for pair in _APART)
            if apart and len(_ALIKE_IN_MOTION & set(effects)) < 2:
                break
        yield Wanted("c", effects, tuple(map(str, rng.choice(STRENGTHS[1:], count))), seed)


def _none() -> Iterator[Wanted]:
    yield from (Wanted("d", seed=seed) for seed in itertools.count())


def _active() -> Iterator[Wanted]:
    for seed in itertools.count():
        yield Wanted("e", seed=seed, against="paper", size=(424, 240), frames=24)
        yield Wanted("e", seed=seed, against="d435", size=(424, 240), frames=24)


def _speed() -> Iterator[Wanted]:
    yield from (Wanted("a", ("incidence_noise",), ("medium",), seed, 40, (424, 240)) for seed in (9001, 9002, 9003))


def slice_cases() -> Iterator[Wanted]:
    """Some 20 cheap cases over the tiers a to d, for the tests: 16 frames of 212x120."""
    small = {"frames": 16, "size": (212, 120)}
    for effect, strength in (
        ("material_noise", "strong"),
        ("disparity_noise", "strong"),
        ("fill_rate", "medium"),
        ("baseline_scale", "strong"),
        ("extrinsic_rotation", "strong"),
        ("lens_distortion", "strong"),
        ("time_offset", "strong"),
        ("incidence_noise", "strong"),
        ("spatial_correlation", "medium"),
        ("temporal_correlation", "medium"),
        ("heavy_tails", "medium"),
        ("max_range", "medium"),
        ("invalid_band", "medium"),
        ("material_dropout", "strong"),
    ):
        yield Wanted("a", (effect,), (strength,), 500, **small)  # type: ignore[arg-type]
    for effect in ("row_banding", "height_bias"):
        yield Wanted("b", (effect,), ("strong",), 500, **small)  # type: ignore[arg-type]
    yield Wanted("c", ("baseline_scale", "fill_rate"), ("strong", "medium"), 500, **small)  # type: ignore[arg-type]
    yield Wanted("c", ("incidence_noise", "invalid_band"), ("strong", "medium"), 500, **small)  # type: ignore[arg-type]
    for seed in (500, 501):
        yield Wanted("d", seed=seed, **small)  # type: ignore[arg-type]
