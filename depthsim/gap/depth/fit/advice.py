"""What recording would tell apart effects that explain the one at hand equally well."""

from collections.abc import Sequence

_NEEDS = {
    "time_offset": "fast turns in several directions, with stops between them",
    "rolling_shutter": "fast turns, which bend straight edges between the first row and the last",
    "extrinsic_rotation": "a camera that stands still before a wall and before a corner",
    "lens_distortion": "a flat wall that fills the picture to its corners",
    "baseline_scale": "one flat target at several known ranges, from near to far",
    "disparity_offset": "one flat target at several known ranges, from near to far",
    "thermal_drift": "one unchanged view from a cold start until the depth no longer moves",
    "subpixel_bias": "a wall that is left slowly, so that the disparity passes through many whole pixels",
    "disparity_quantization": "a slanted wall far away, where one step of the disparity is wide",
    "material_noise": "several materials, each at several ranges",
    "disparity_noise": "one material at many ranges",
    "incidence_noise": "one wall at one range under many angles",
    "incidence_dropout": "one wall at one range under many angles",
    "lateral_noise": "sharp depth edges, and slanted surfaces beside frontal ones",
    "vignetting_noise": "a flat frontal wall that fills the picture",
    "motion_noise": "the same view at rest and in fast motion",
    "spatial_correlation": "a flat frontal wall, without filters in the camera",
    "spatial_filter": "a sharp depth edge before a far background, with the camera's filters off and on",
    "temporal_correlation": "a camera that stands still, at the full frame rate",
    "heavy_tails": "a flat wall away from any depth edge",
    "flying_pixels": "a thin object before a far background",
    "edge_fattening": "a sharp straight edge before a far background",
    "stereo_shadow": "a near object before a far background",
    "invalid_band": "a near wall that fills the left border of the picture",
    "range_dropout": "one material out to ranges where returns are lost",
    "max_range": "one material out to ranges where returns are lost",
    "min_range": "one material in to ranges where returns are lost",
    "material_dropout": "the same range and angle on several materials",
    "specular_dropout": "a glossy surface seen straight on and at a slant",
    "ambient_light": "the same view with and without sun",
    "fill_rate": "a frontal, matt, textured wall at a middle range",
}


def advice_for(effect: str, ties: Sequence[str]) -> str:
    """The recording that would break a tie; empty without one."""
    if not ties:
        return ""
    wishes = list(dict.fromkeys(_NEEDS[name] for name in (effect, *ties) if name in _NEEDS))
    if not wishes:
        return f"record more ranges, angles, motions and materials to tell {effect} from {', '.join(ties)}"
    return f"to tell {effect} from {', '.join(ties)}, record " + "; and ".join(wishes[:3])
