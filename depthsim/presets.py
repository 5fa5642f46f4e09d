"""The RealSense D400 depth cameras, from what their maker says of them."""

import math
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

from depthsim.camera import Camera, read_camera
from depthsim.errors import InputError
from depthsim.yamlfile import beside, validate

Resolution = tuple[int, int]
"""(width, height) [px]."""

DISPARITIES = 126
"""[px] The widest disparity that the D4 processor searches for."""

MODES: dict[Resolution, tuple[int, ...]] = {
    (1280, 720): (6, 15, 30),
    (848, 480): (6, 15, 30, 60, 90),
    (640, 480): (6, 15, 30, 60, 90),
    (640, 360): (6, 15, 30, 60, 90),
    (480, 270): (6, 15, 30, 60, 90),
    (424, 240): (6, 15, 30, 60, 90),
}
"""The depth resolutions of all these cameras, with their frame rates [Hz] on USB 3; some list 5 in place of 6 Hz.

Source: datasheet 337029-005, image formats (USB 3.1 Gen 1); rs-enumerate-devices of a D435, librealsense issue 11511.
"""

_DATASHEET = "RealSense D400 series datasheet, document 337029"


@dataclass(frozen=True)
class ColorPreset:
    """What is known of a colour camera. fov: of its whole picture, horizontally [deg]. imager: its size.

    x: where it is, along the left imager's x [m]; it looks the same way. Real units are turned by up to a degree and
    off by a millimetre, and are calibrated one by one: librealsense issue 7300 has f = 612 px at 640x480 of a D435
    (here 621), realsense-ros issue 2788 its extrinsics.
    """

    fov: float
    imager: Resolution
    x: float


@dataclass(frozen=True)
class Preset:
    """What is known of one camera. ``sources`` says where each fact is from, by the name of its field.

    The focal length follows from the nominal horizontal field of view, at the full width of the imager. The datasheet
    allows ±3° from lens to lens, and its two angles do not fit square pixels: the D435's 87° give 674 px at 1280x720,
    its 58° give 649 px, and real units have 638 to 650 px. So the focal length of a preset is about 5 % longer than
    that of a unit in hand; give that unit's camera.yaml where it matters.
    """

    name: str
    baseline: float  # [m]
    fov: tuple[float, float]  # of the 16:9 depth image, horizontal and vertical [deg]
    imager: Resolution
    shutter: Literal["global", "rolling"]
    default: Resolution  # the one that the maker recommends
    recommended_range: tuple[float, float]  # [m]
    min_z_table: dict[Resolution, float]  # [m]
    color: ColorPreset
    depth_scale: float = 0.001  # [m] per unit
    sources: dict[str, str] = field(default_factory=dict)

    def focal_length(self, width: int, height: int) -> float:
        """Focal length [px] of an image of any size; pixels are square.

        An image as wide as 16:9, or wider, shows the full width of the imager. A narrower one, such as 4:3, shows its
        full height and is cropped at the sides: 640x480 is 1280x800 scaled by 0.6 on a D435 and 1920x1080 scaled by
        4/9 on a D415, as their datasheet angles for VGA have it (75° and 50°).
        """
        return _focal_length(self.imager, self.fov[0], width, height)

    def _color_keys(self, width: int, height: int) -> dict[str, Any]:
        """The colour camera at a resolution; it is scaled and cropped as the depth camera is."""
        focal = _focal_length(self.color.imager, self.color.fov, width, height)
        middle = {"cx": (width - 1) / 2, "cy": (height - 1) / 2}
        place = {"translation": (self.color.x, 0.0, 0.0)}
        return {"width": width, "height": height, "fx": focal, "fy": focal, **middle, **place}

    def min_z(self, width: int, height: int) -> float:
        """The least depth [m] at a resolution: from the datasheet's table, else f·b / 126 px.

        The rule is a lower bound. The table is above it by up to 20 mm: within 5 % at 1280x720, but by 20 % for the
        D435 at 480x270 and by 25 % for the D405 at 424x240.
        """
        rule = self.focal_length(width, height) * self.baseline / DISPARITIES
        return self.min_z_table.get((width, height), rule)

    def camera(self, width: int | None = None, height: int | None = None, rate: float | None = None) -> Camera:
        """The camera at a resolution (the recommended one if none is given) and a frame rate (30 Hz).

        Its colour camera has the same resolution.
        """
        if (width is None) != (height is None):
            raise InputError(self.name.lower(), "", "width and height go together", "give both or neither")
        width, height = (width, height) if width is not None and height is not None else self.default
        keys = {
            "name": self.name,
            "width": width,
            "height": height,
            "fx": self.focal_length(width, height),
            "fy": self.focal_length(width, height),
            "cx": (width - 1) / 2,
            "cy": (height - 1) / 2,
            "baseline": self.baseline,
            "depth_scale": self.depth_scale,
            "rate": 30.0 if rate is None else rate,
            "color": self._color_keys(width, height),
        }
        return validate(Camera, keys, Path(self.name.lower()))


def _focal_length(imager: Resolution, fov: float, width: int, height: int) -> float:
    full_width = imager[0] / 2 / math.tan(math.radians(fov / 2))
    scale, tall = width / imager[0], height / imager[1]
    # 848x480 and 424x240 are a little taller than 16:9 and yet show the full width.
    return full_width * (tall if tall > 1.01 * scale else scale)


_URDF = "realsense-ros, realsense2_description/urdf"
_SOURCES = {
    "baseline": f"{_DATASHEET}, depth camera SKU properties",
    "fov": f"{_DATASHEET} (May 2020), depth camera SKU properties, HD: ±3° horizontally",
    "imager": f"{_DATASHEET}, left and right imager properties",
    "shutter": "product page",
    "default": "maker's tuning guide (best known methods for D415 and D435)",
    "recommended_range": "product page, ideal range",
    "min_z_table": f"{_DATASHEET}, table Minimum-Z Depth (4-11 in revision 017, 4-12 in March 2026)",
    "depth_scale": "librealsense, RS2_OPTION_DEPTH_UNITS: 0.001 m but for the D405",
    "color": f"fov and imager: {_DATASHEET}, colour image sensor properties; x: {_URDF}, cam_depth_to_color_offset",
}

_D435 = Preset(
    name="D435",
    baseline=0.050,
    fov=(87, 58),
    imager=(1280, 800),
    shutter="global",
    default=(848, 480),
    recommended_range=(0.3, 3.0),
    min_z_table={
        (1280, 720): 0.280,
        (848, 480): 0.195,
        (640, 480): 0.175,
        (640, 360): 0.150,
        (480, 270): 0.120,
        (424, 240): 0.105,
    },
    color=ColorPreset(fov=69, imager=(1920, 1080), x=-0.015),
    sources=_SOURCES,
)

PRESETS: dict[str, Preset] = {
    "d405": Preset(
        name="D405",
        baseline=0.018,
        fov=(87, 58),
        imager=(1280, 800),
        shutter="global",
        default=(848, 480),
        recommended_range=(0.07, 0.5),
        min_z_table={
            (1280, 720): 0.100,
            (848, 480): 0.070,
            (640, 360): 0.055,
            (480, 270): 0.045,
            (424, 240): 0.040,
        },
        color=ColorPreset(fov=87, imager=(1280, 800), x=0.0),
        depth_scale=0.0001,
        sources=_SOURCES
        | {
            "fov": "product page; the maker's comparison chart says 84° (librealsense issue 11427)",
            "default": "product page, which gives the minimum depth, 7 cm, at 480p",
            "min_z_table": f"{_DATASHEET}, Minimum-Z Depth of the D401, as its distributor quotes it; no 640x480",
            "depth_scale": "librealsense pull request 8946: 0.0001 m",
            "color": "product page: it has no colour camera of its own, the left imager gives the colour",
        },
    ),
    "d415": Preset(
        name="D415",
        baseline=0.055,
        fov=(65, 40),
        imager=(1920, 1080),
        shutter="rolling",
        default=(1280, 720),
        recommended_range=(0.5, 3.0),
        min_z_table={(1280, 720): 0.450, (424, 240): 0.160},
        color=ColorPreset(fov=69, imager=(1920, 1080), x=-0.015),
        sources=_SOURCES
        | {
            "fov": f"{_DATASHEET} (May 2020), depth camera SKU properties, HD: ±2° horizontally",
            "min_z_table": f"{_DATASHEET}, Minimum-Z Depth, and the product page for the least; the rest by the rule",
        },
    ),
    "d435": _D435,
    "d435i": replace(_D435, name="D435i"),
    "d455": Preset(
        name="D455",
        baseline=0.095,
        fov=(87, 58),
        imager=(1280, 800),
        shutter="global",
        default=(848, 480),
        recommended_range=(0.6, 6.0),
        min_z_table={(1280, 720): 0.520},
        color=ColorPreset(fov=90, imager=(1280, 800), x=0.059),
        sources=_SOURCES
        | {
            "fov": "product page",
            "default": "librealsense issues 9241 and 11180",
            "min_z_table": f"{_DATASHEET}, Minimum-Z Depth; the rest by the rule (0.34 m at 848x480, issue 9241)",
        },
    ),
}
"""By lower-case name."""


def preset(name: str, width: int | None = None, height: int | None = None, rate: float | None = None) -> Camera:
    """A RealSense camera by name, in any case; see :meth:`Preset.camera`."""
    if name.lower() not in PRESETS:
        raise InputError(name, "", "is no camera preset", f"the presets are {', '.join(PRESETS)}")
    return PRESETS[name.lower()].camera(width, height, rate)


def load_camera(
    camera: str | Path | Camera, width: int | None = None, height: int | None = None, rate: float | None = None
) -> Camera:
    """A camera: the name of a preset (``d435``), the path of a camera.yaml, or a :class:`Camera`, which stays as it is.

    width, height: [px] of a preset, the recommended ones by default. rate: [Hz] in place of the camera's own.
    Raises :class:`InputError`, also where another size is asked of a camera that is no preset.
    """
    if isinstance(camera, str) and camera.lower() in PRESETS:
        return preset(camera, width, height, rate)
    if width is not None or height is not None:
        name = camera.name if isinstance(camera, Camera) else str(camera)
        raise InputError(name, "", "has a size of its own", f"only presets have several: {', '.join(PRESETS)}")
    found = camera if isinstance(camera, Camera) else resolve_camera(camera)
    return found if rate is None else found.model_copy(update={"rate": rate})


def resolve_camera(value: Any, file: Path | None = None, place: str = "camera") -> Camera:
    """A camera from what a user writes: the name of a preset, the path of a camera.yaml, or its keys.

    file: where it is written, and ``place`` where in it; a path is then looked for in that file's folder.
    """
    if isinstance(value, dict):
        return validate(Camera, value, file or Path(place), place if file else "")
    if isinstance(value, str) and value.lower() in PRESETS:
        return preset(value)
    if isinstance(value, str | Path) and Path(value).suffix.lower() in (".yaml", ".yml"):
        return read_camera(beside(file, str(value), place) if file else Path(value))
    fix = f"name one of {', '.join(PRESETS)}, a camera.yaml, or write its keys"
    raise InputError(file or place, place if file else "", f"{value!r} is no camera", fix)
