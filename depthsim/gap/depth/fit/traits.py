"""What an effect is known to do, as far as the search asks."""

from collections.abc import Sequence

from depthsim.camera import Camera
from depthsim.sensor.effect import Stage, effect_class
from depthsim.sensor.pipeline import bending


def has_more_pixels(effect: str, camera: Camera) -> bool:
    """Whether an effect takes a picture of more pixels than ``camera`` has."""
    eye = effect_class(effect)().imager(camera)
    return eye.width * eye.height > camera.width * camera.height


def bends_rays(effect: str) -> bool:
    """Whether an effect has the scene cast anew."""
    return bool(bending([effect_class(effect)()]))


def is_filter(effect: str) -> bool:
    """Whether an effect makes neighbours go together and takes noise away, as one picture is smoothed."""
    return effect_class(effect).kinds[:2] == ("correlation", "spread")


def is_filling(effect: str) -> bool:
    """Whether an effect fills holes of others."""
    return any(is_anywhere(other) for other in effect_class(effect).seen_on)


def fills_besides(effect: str) -> bool:
    """Whether an effect fills holes besides what it does to a finished picture."""
    known = effect_class(effect)
    return known.stage >= Stage.PROCESSING and known.kinds[0] in ("correlation", "spread") and "missing" in known.kinds


def is_anywhere(effect: str) -> bool:
    """Whether an effect loses pixels anywhere."""
    return not effect_class(effect).axes and effect_class(effect).kinds == ("missing",)


def acts_along(effect: str, kind: str, along: set[str]) -> bool:
    """Whether an effect makes a kind of error first, along one of some axes."""
    known = effect_class(effect)
    return kind == known.kinds[0] and bool(along & set(known.axes))


def is_known_by(effect: str, first: Sequence[tuple[str, set[str]]]) -> bool:
    """Whether the axis that an effect is known by is the first one of its kind of error."""
    known = effect_class(effect)
    return any(kind == known.kinds[0] and along & set(known.axes[:1]) for kind, along in first)
