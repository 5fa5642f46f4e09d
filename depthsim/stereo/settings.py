"""What active stereo is made of: projector, light, imagers and matcher, each with its numbers and where they are from.

The numbers of the parts are a D435's where they are public. What is not public (optical power, blur, speckle, the
matcher's thresholds) is tuned by ``benchmarks/stereo.py`` so that the depth has the figures of real D435 frames, and by
``benchmarks/stereo_matching.py``, where the images are spoiled.
"""

from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator

from depthsim.errors import InputError
from depthsim.stereo import presets
from depthsim.yamlfile import validate

SENSOR = "active_stereo"


class _Part(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Projector(_Part):
    """The laser that throws a fixed pattern of dots.

    Sources: "Projectors for D400 Series Depth Cameras" (Grunnet-Jepsen et al., Intel): about 5000 dots, D435;
    D400 datasheet, wide projector: 850 nm, field of projection 86° x 57°. Its 360 mW are electrical (librealsense issue
    2101), so the optical power is an estimate.
    """

    power: FiniteFloat = Field(
        default=0.08, ge=0, le=10, description="optical power of all dots together [W]; 0 is off"
    )
    dots: int = Field(default=5000, ge=0, le=200_000, description="dots in the whole field")
    field: tuple[FiniteFloat, FiniteFloat] = Field(
        default=(86.0, 57.0), description="of projection, across and down [deg]"
    )
    dot_width: FiniteFloat = Field(
        default=1.2, ge=0.3, le=10, description="standard deviation of a dot's profile [mrad]"
    )
    position: FiniteFloat = Field(default=0.58, ge=-2, le=3, description="along the baseline: 0 left, 1 right imager")
    speckle: FiniteFloat = Field(default=0.42, ge=0, le=1, description="contrast of the laser's speckle in one pixel")
    pattern: int = Field(default=0, ge=0, description="which random pattern")

    @model_validator(mode="after")
    def _field_is_an_angle(self) -> "Projector":
        if not all(1 <= angle <= 170 for angle in self.field):
            raise ValueError("field must be two angles from 1 to 170 degrees")
        return self


class Light(_Part):
    """The other light, weighted as the imagers see it and expressed as irradiance at 850 nm."""

    ambient: FiniteFloat = Field(default=0.4, ge=0, le=1000, description="from everywhere [W/m²]; 0 is night")
    sun: FiniteFloat = Field(default=0.0, ge=0, le=2000, description="on a surface square to the sun [W/m²]")
    sun_direction: tuple[FiniteFloat, FiniteFloat, FiniteFloat] = Field(
        default=(0.4, 0.3, 0.85), description="towards the sun, world frame"
    )

    @model_validator(mode="after")
    def _direction_has_length(self) -> "Light":
        if not any(self.sun_direction):
            raise ValueError("sun_direction has no length")
        return self


class Imager(_Part):
    """The two infrared cameras. The D435's have 1280x800 pixels of 3 µm, f/2 and a global shutter (D400 datasheet)."""

    f_number: FiniteFloat = Field(default=2.0, gt=0.5, le=32, description="focal length over aperture")
    sensor_width: FiniteFloat = Field(default=3.84e-3, gt=1e-4, le=0.1, description="of the full image [m]")
    quantum_efficiency: FiniteFloat = Field(default=0.35, gt=0, le=1, description="at 850 nm")
    full_well: FiniteFloat = Field(default=7000.0, ge=100, le=1e6, description="electrons at 255, gain 1")
    read_noise: FiniteFloat = Field(default=10.0, ge=0, le=1000, description="[electrons]")
    blur: FiniteFloat = Field(
        default=0.5, ge=0, le=5, description="standard deviation of the lens's spread [px at width 848]"
    )
    vignetting: FiniteFloat = Field(default=0.8, ge=0, le=2, description="share of the law cos⁴")
    exposure: FiniteFloat | Literal["auto"] = Field(default="auto", description="[s], or auto")
    gain: FiniteFloat = Field(default=1.0, gt=0, le=100, description="with a fixed exposure")
    longest_exposure: FiniteFloat = Field(default=0.0165, gt=0, le=1, description="of auto [s]")
    highest_gain: FiniteFloat = Field(
        default=8.0, ge=1, le=100, description="of auto, once the exposure is at its longest"
    )
    target: FiniteFloat = Field(
        default=0.25, gt=0, lt=1, description="mean of the image that auto aims at, share of white"
    )
    imbalance: FiniteFloat = Field(default=0.02, ge=-0.9, le=10, description="how much brighter the right image is")
    samples: int = Field(
        default=2, ge=1, le=8, description="rays a pixel across; down, half as many where dots allow it"
    )

    @model_validator(mode="after")
    def _exposure_is_positive(self) -> "Imager":
        if self.exposure != "auto" and not 0 < self.exposure <= 1:
            raise ValueError("exposure must be auto or from 0 to 1 s")
        return self


class MatcherSettings(_Part):
    """How disparity is found; the D4 chip has the same steps (librealsense, advanced mode), its numbers are its own."""

    preset: presets.Name = Field(default="default", description="of the D400s; sets what is not set beside it")
    disparities: int = Field(default=126, ge=8, le=512, description="searched, from 0 [px]")
    least_disparity: FiniteFloat = Field(
        default=1.0, ge=0, le=64, description="what is less is no match but an end of the search [px]"
    )
    tolerance: FiniteFloat = Field(
        default=1.5, ge=0, le=20, description="two pixels differ if by more than this x the noise"
    )
    least_tolerance: FiniteFloat = Field(
        default=1.0, ge=0, le=255, description="the same where there is no noise [grey]"
    )
    window: tuple[int, int] = Field(default=(7, 5), description="costs are added over, across and down [px]; odd")
    small_step: int = Field(
        default=25, ge=0, le=200, description="P1: a change of 1 px along a path, cost a window pixel"
    )
    large_step: int = Field(
        default=104, ge=0, le=400, description="P2: a larger change, cost a window pixel; a byte holds 116"
    )
    second_peak: FiniteFloat = Field(
        default=0.22, ge=0, le=10, description="share by which the best beats all but its neighbours, to be firm"
    )
    left_right: FiniteFloat = Field(default=1.5, ge=0, le=64, description="most that left and right may differ [px]")
    neighbours: FiniteFloat = Field(default=0.5, ge=0, le=1, description="share of the neighbourhood that is firm")
    neighbourhood: tuple[int, int] = Field(default=(21, 9), description="across and down [px]; odd")
    median: FiniteFloat = Field(
        default=0.2, ge=0, le=4, description="how far the quantile of all costs is above the best, share of census bits"
    )
    quantile: FiniteFloat = Field(default=0.5, ge=0, le=1, description="which quantile")
    torn_reach: int = Field(
        default=4, ge=0, le=32, description="beside a jump, along row or column, what fits both is dropped [px]"
    )
    torn_share: FiniteFloat = Field(default=0.2, ge=0, le=10, description="how much worse the other side must fit")
    worst_score: FiniteFloat = Field(
        default=0.4, gt=0, le=1, description="highest share of census bits that may differ"
    )
    margin: int = Field(default=7, ge=0, le=64, description="pixels at the right image's left border not matched to")
    support: tuple[int, int] = Field(default=(17, 9), description="largest region of the sub-pixel step [px]; odd")
    steps: int = Field(default=2, ge=1, le=10, description="least-squares steps of the sub-pixel shift")
    floor: FiniteFloat = Field(default=4.0, ge=0.01, le=255, description="contrast that counts as much as noise [grey]")
    texture: FiniteFloat = Field(default=0.1, ge=0, description="least sum of squared slopes in the support region")
    smoothing: tuple[int, int] = Field(
        default=(9, 9), description="the disparity becomes the mean over, across and down [px]; odd"
    )
    smoothing_step: FiniteFloat = Field(
        default=4.0, gt=0, le=64, description="the mean is of what differs by less, a ramp in place of a step [px]"
    )
    speckle_size: int = Field(default=60, ge=0, le=100_000, description="smaller patches are dropped [px]")
    speckle_step: FiniteFloat = Field(default=1.0, ge=0, le=64, description="most change within a patch [px]")

    @model_validator(mode="before")
    @classmethod
    def _preset_is_filled_in(cls, values: Any) -> Any:
        name = values.get("preset", "default") if isinstance(values, dict) else None
        return presets.thresholds(name) | values if name in presets.CHIP else values

    @model_validator(mode="after")
    def _sizes_are_odd(self) -> "MatcherSettings":
        for name in ("window", "support", "neighbourhood", "smoothing"):
            if not all(size % 2 == 1 and 1 <= size <= 63 for size in getattr(self, name)):
                raise ValueError(f"{name} must be two odd numbers from 1 to 63")
        if self.window[0] * self.window[1] > 1000:
            raise ValueError("window is too large: its costs must fit in 16 bits")
        return self


class ActiveStereo(_Part):
    """Everything that `camera: {sensor: active_stereo}` may set beside the camera itself."""

    projector: Projector = Projector()
    light: Light = Light()
    imager: Imager = Imager()
    matcher: MatcherSettings = MatcherSettings()

    def camera_keys(self) -> dict[str, Any]:
        """What stands under `camera` in a profile, beside the camera's own keys."""
        return {"sensor": SENSOR, **self.model_dump(mode="json")}


def split_camera(value: Any, path: Path) -> tuple[Any, ActiveStereo | None]:
    """A profile's `camera`, parted into what describes the camera and what active stereo is made of, if it is that.

    `{sensor: active_stereo}` may hold the keys of camera.yaml, or `preset: d435`, or neither.
    """
    if not isinstance(value, dict) or "sensor" not in value:
        return value, None
    rest = dict(value)
    if rest.pop("sensor") != SENSOR:
        raise InputError(path, "camera.sensor", f"{value['sensor']!r} is no sensor", f"write {SENSOR}, or leave it out")
    parts = {key: rest.pop(key) for key in ActiveStereo.model_fields if key in rest}
    stereo = validate(ActiveStereo, parts, path, "camera")
    preset = rest.pop("preset", None)
    if preset is not None and rest:
        fix = "write either preset or the keys of camera.yaml"
        raise InputError(path, f"camera.{next(iter(rest))}", "stands beside preset", fix)
    return preset if preset is not None else rest or None, stereo
