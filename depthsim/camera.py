"""The geometry of one depth camera: intrinsics, distortion, stereo baseline, and the colour camera beside it."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, PrivateAttr, model_validator

from depthsim.yamlfile import read_model

Distortion = tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat]
_STRAIGHT = (0.0, 0.0, 0.0, 0.0, 0.0)
_PICTURE = ("width", "height", "fx", "fy", "cx", "cy", "distortion")
"""The keys that say how a picture is projected: those of a camera, and those of the other camera beside it."""


class Intrinsics(BaseModel):
    """How one picture is projected; see :class:`Camera` for pixels and distortion."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    width: int = Field(gt=0, le=16384, description="[px]")
    height: int = Field(gt=0, le=16384, description="[px]")
    fx: FiniteFloat = Field(gt=0, description="[px]")
    fy: FiniteFloat = Field(gt=0, description="[px]")
    cx: FiniteFloat = Field(description="[px]")
    cy: FiniteFloat = Field(description="[px]")
    distortion: Distortion = Field(_STRAIGHT, description="Brown-Conrady k1, k2, p1, p2, k3, in OpenCV's order")

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of an image [px]."""
        return self.height, self.width


class ColorCamera(Intrinsics):
    """The colour camera: its intrinsics, and its pose in the left imager's optical frame."""

    rotation: tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat] = Field(
        (0.0, 0.0, 0.0, 1.0), description="quaternion x y z w, colour camera to left imager"
    )
    translation: tuple[FiniteFloat, FiniteFloat, FiniteFloat] = Field(
        description="where the colour camera is, in the left imager's frame [m]"
    )

    @model_validator(mode="after")
    def _rotation_is_one(self) -> "ColorCamera":
        if not abs(float(np.linalg.norm(self.rotation)) - 1) < 1e-3:
            raise ValueError("the quaternion `rotation` (x y z w) is not of length 1")
        return self

    @property
    def pose(self) -> NDArray[np.float64]:
        """(4, 4) colour camera to left imager."""
        from depthsim.trajectory.rotation import rotation_matrices  # whose package brings all that reads scenes

        pose, quaternion = np.eye(4), np.array([self.rotation], np.float64)
        pose[:3, :3] = rotation_matrices(quaternion / np.linalg.norm(quaternion))[0]
        pose[:3, 3] = self.translation
        return pose


class Camera(BaseModel):
    """A pinhole or Brown-Conrady camera, as in camera.yaml.

    The optical frame is x right, y down, z forward. Pixel (u, v) is the sample at the centre of its cell: its ray is
    ((u - cx) / fx, (v - cy) / fy, 1), u and v counted from 0. Depth belongs to the left imager; the right imager
    sits at +baseline along x. A distortion that folds the image over (no ray for some pixel) is rejected.

    ``color`` is the colour camera beside the left imager. Where ``aligned`` is true the pictures are those of the
    colour camera: the left imager has measured and its depth was resampled, as librealsense's align does. Intrinsics,
    rays and poses are the colour camera's then, and :attr:`left` is the camera that has measured.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    model: Literal["pinhole", "brown_conrady"] = "pinhole"
    name: str = "camera"
    width: int = Field(gt=0, le=16384, description="[px]")
    height: int = Field(gt=0, le=16384, description="[px]")
    fx: FiniteFloat = Field(gt=0, description="[px]")
    fy: FiniteFloat = Field(gt=0, description="[px]")
    cx: FiniteFloat = Field(description="[px]")
    cy: FiniteFloat = Field(description="[px]")
    distortion: Distortion = Field(_STRAIGHT, description="Brown-Conrady k1, k2, p1, p2, k3, in OpenCV's order")
    baseline: FiniteFloat = Field(gt=0, description="left to right imager [m]")
    depth_scale: FiniteFloat = Field(0.001, gt=0, description="metres per unit of the 16-bit depth")
    rate: FiniteFloat = Field(30.0, gt=0, description="frames per second [Hz]")
    color: ColorCamera | None = Field(None, description="the colour camera")
    aligned: bool = Field(False, description="whether the depth was resampled into the colour camera")
    depth: Intrinsics | None = Field(None, description="of an aligned camera, the left imager's before that")

    @model_validator(mode="after")
    def _aligned_has_its_cameras(self) -> "Camera":
        if not self.aligned:
            if self.depth is not None:
                raise ValueError("`depth` is of an aligned camera: write `aligned: true`, or leave it out")
            return self
        if self.color is None:
            raise ValueError("aligned is true without `color`: write the colour camera's intrinsics and its pose there")
        for name in _PICTURE:
            own, theirs = getattr(self, name), getattr(self.color, name)
            if not np.allclose(own, theirs, rtol=0, atol=1e-3):
                text = f"{name} is {own}, and color.{name} {theirs}: of an aligned camera they are the same"
                raise ValueError(text)
        return self

    @model_validator(mode="after")
    def _distortion_has_a_model(self) -> "Camera":
        if self.model == "pinhole" and any(self.distortion):
            raise ValueError("distortion is given but model is pinhole: write `model: brown_conrady`")
        return self

    @model_validator(mode="after")
    def _distortion_can_be_undone(self) -> "Camera":
        if any(self.distortion):
            u, v = np.arange(self.width, dtype=np.float64), np.arange(self.height, dtype=np.float64)
            u = np.concatenate([u, u, np.zeros_like(v), np.full_like(v, self.width - 1)])
            v = np.concatenate([np.zeros(self.width), np.full(self.width, self.height - 1.0), v, v])
            undone = _is_undone((u - self.cx) / self.fx, (v - self.cy) / self.fy, self.distortion)
            if not undone.all():
                worst = int(np.argmin(undone))
                place = f"({u[worst]:.0f}, {v[worst]:.0f})"
                raise ValueError(f"no ray is bent to pixel {place}: the distortion folds over inside the image")
        return self

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> "Camera":
        """A copy with other values, checked like any camera; pydantic's own would keep the rays of the old one.

        Of an aligned camera the colour camera's intrinsics change with the camera's own.
        """
        update = dict(update or {})
        if self.aligned and self.color is not None and not {"color", "aligned"} & update.keys():
            update["color"] = self.color.model_dump() | {k: update[k] for k in _PICTURE if k in update}
        return Camera.model_validate({**self.model_dump(), **update})

    def aligned_to_color(self) -> "Camera":
        """The camera whose pictures are those of this one, resampled into its colour camera; itself if it is that.

        ValueError where there is no colour camera.
        """
        return self if self.aligned else self._in_color

    @cached_property
    def _in_color(self) -> "Camera":
        if self.color is None:
            raise ValueError(f"{self.name} has no colour camera")
        own = {name: getattr(self, name) for name in _PICTURE}
        return self._with(self.color, aligned=True, depth=own)

    @cached_property
    def left(self) -> "Camera":
        """The camera that measures: the left imager's, with its colour camera, where this one is aligned; else itself.

        Where an aligned camera does not say what its left imager was, it is that of the preset of its name, or else a
        D435's, at the size of the pictures.
        """
        if not self.aligned:
            return self
        return self._with(self.depth or self._usual_left(), aligned=False, depth=None)

    def _with(self, picture: Intrinsics, **others: Any) -> "Camera":
        keys = self.model_dump() | {name: getattr(picture, name) for name in _PICTURE} | others
        return Camera.model_validate(keys | {"model": "brown_conrady" if any(picture.distortion) else "pinhole"})

    def _usual_left(self) -> Intrinsics:
        from depthsim.presets import PRESETS  # which is made of cameras

        focal = PRESETS.get(self.name.lower(), PRESETS["d435"]).focal_length(self.width, self.height)
        cx, cy = (self.width - 1) / 2, (self.height - 1) / 2
        size = {"width": self.width, "height": self.height}
        return Intrinsics.model_validate({**size, "fx": focal, "fy": focal, "cx": cx, "cy": cy})

    @property
    def is_aligned_unsaid(self) -> bool:
        """Whether it has its colour camera's own intrinsics, as only aligned pictures have, and does not say so."""
        return (
            not self.aligned
            and self.color is not None
            and all(np.allclose(getattr(self, name), getattr(self.color, name), rtol=0, atol=1e-3) for name in _PICTURE)
        )

    @cached_property
    def left_pose(self) -> NDArray[np.float64]:
        """(4, 4) the left imager in this camera's frame: to be put behind a pose of this camera."""
        pose = self.color.pose if self.aligned and self.color is not None else np.eye(4)
        return np.asarray(np.linalg.inv(pose))

    def _fields(self) -> tuple[object, ...]:
        return tuple(getattr(self, name) for name in type(self).model_fields)

    # pydantic would compare the arrays that cached properties leave in __dict__, too.
    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, Camera) and self._fields() == other._fields())

    def __hash__(self) -> int:
        return hash(self._fields())

    @property
    def shape(self) -> tuple[int, int]:
        """(height, width) of an image [px]."""
        return self.height, self.width

    @property
    def whole(self) -> "Camera":
        """The camera whose picture this one's is a part of: this one, unless it is a :class:`Window`."""
        return self

    @property
    def rows(self) -> NDArray[np.intp]:
        """(height,) where each row lies in the picture of ``whole``."""
        return np.arange(self.height)

    def window(self, rows: NDArray[np.integer]) -> "Camera":
        """The camera that has only some of the rows; itself where these are all."""
        return self if np.array_equal(rows, self.rows) else Window(self, rows)

    @property
    def focal_baseline(self) -> float:
        """f·b of the left imager [px m]: depth is this over disparity (Eq. 2 of the paper)."""
        return self.left.fx * self.baseline

    @cached_property
    def rays(self) -> NDArray[np.float32]:
        """(2, height, width) float32: x and y of each pixel's ray at z = 1, distortion undone."""
        x = np.broadcast_to((np.arange(self.width) - self.cx) / self.fx, self.shape)
        y = np.broadcast_to(((np.arange(self.height) - self.cy) / self.fy)[:, None], self.shape)
        if any(self.distortion):
            x, y = undistort(x, y, self.distortion)
        return np.ascontiguousarray(np.stack([x, y]), dtype=np.float32)

    def write(self, path: Path) -> None:
        """Write camera.yaml."""
        path.write_text(self.to_yaml(), encoding="utf-8")

    def to_yaml(self) -> str:
        """The text of camera.yaml."""
        keys = self.model_dump(mode="json", exclude_none=True)
        for part in (keys, keys.get("color", {}), keys.get("depth", {})):
            if not any(part.get("distortion", ())):
                part.pop("distortion", None)
        if not self.aligned:
            del keys["aligned"]
        return yaml.safe_dump(keys, sort_keys=False)


class Window(Camera):
    """Some rows of a camera's picture, one below the other: their rays, bit for bit, and where in it they are."""

    _whole: Camera = PrivateAttr()
    _rows: tuple[int, ...] = PrivateAttr()

    def __init__(self, whole: Camera, rows: NDArray[np.integer]) -> None:
        if not len(rows) or rows[0] < 0 or rows[-1] >= whole.height or (np.diff(rows) < 1).any():
            raise ValueError(f"rows must be some of {whole.height}, from top to bottom")
        super().__init__(**whole.model_dump() | {"height": len(rows)})
        self._whole, self._rows = whole, tuple(map(int, rows))

    def _fields(self) -> tuple[object, ...]:
        return (*super()._fields(), self._whole, self._rows)

    @property
    def whole(self) -> Camera:
        """The camera with all rows."""
        return self._whole

    @property
    def rows(self) -> NDArray[np.intp]:
        """(height,) where each row lies in the picture of ``whole``."""
        return np.array(self._rows)

    @cached_property
    def rays(self) -> NDArray[np.float32]:
        """(2, height, width) float32, as those of the whole camera."""
        return np.ascontiguousarray(self._whole.rays[:, self._rows])


def read_camera(path: Path) -> Camera:
    """Read camera.yaml."""
    return read_model(Camera, path, "a camera.yaml")


def distort(x: NDArray, y: NDArray, k: tuple[float, ...]) -> tuple[NDArray, NDArray]:
    """Ideal image-plane coordinates (z = 1) to distorted ones: Brown-Conrady (Brown 1966), k1 k2 p1 p2 k3."""
    k1, k2, p1, p2, k3 = k
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def undistort(xd: NDArray, yd: NDArray, k: tuple[float, ...]) -> tuple[NDArray, NDArray]:
    """The inverse of :func:`distort` by Newton's method, float64; not a number where it finds none.

    The point moves out from the axis in steps, each solved from the one before, as a strong distortion has other roots.
    """
    x, y = np.zeros_like(xd, dtype=np.float64), np.zeros_like(yd, dtype=np.float64)
    with np.errstate(all="ignore"):
        for part in np.linspace(1 / 8, 1, 8):
            x, y = _newton(x + xd / 8, y + yd / 8, part * xd, part * yd, k, most=2 if part < 1 else 60)
        ex, ey = distort(x, y, k)
        wrong = ~(np.hypot(ex - xd, ey - yd) < 1e-9)
    x[wrong] = y[wrong] = np.nan
    return x, y


def _newton(
    x: NDArray, y: NDArray, xd: NDArray, yd: NDArray, k: tuple[float, ...], most: int
) -> tuple[NDArray, NDArray]:
    """The root of distort(x, y) = (xd, yd) near (x, y), in at most ``most`` steps; beside a fold there are many."""
    for _ in range(most):
        ex, ey = distort(x, y, k)
        ex, ey = ex - xd, ey - yd
        a, b, c = _jacobian(x, y, k)
        determinant = a * c - b * b
        dx, dy = (c * ex - b * ey) / determinant, (a * ey - b * ex) / determinant
        x, y = x - dx, y - dy
        if max(np.abs(dx).max(), np.abs(dy).max()) < 1e-13:
            break
    return x, y


def _jacobian(x: NDArray, y: NDArray, k: tuple[float, ...]) -> tuple[NDArray, NDArray, NDArray]:
    """The symmetric Jacobian of :func:`distort`: d xd/dx, d xd/dy = d yd/dx, d yd/dy."""
    k1, k2, p1, p2, k3 = k
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))
    return (
        radial + x * x * slope + 2 * p1 * y + 6 * p2 * x,
        x * y * slope + 2 * p1 * x + 2 * p2 * y,
        radial + y * y * slope + 6 * p1 * y + 2 * p2 * x,
    )


def _is_undone(xd: NDArray, yd: NDArray, k: tuple[float, ...]) -> NDArray[np.bool_]:
    """Whether distorted points have a ray of their own: the map does not fold over between the axis and that ray."""
    x, y = undistort(xd, yd, k)
    undone = np.isfinite(x)
    for part in np.linspace(1 / 32, 1, 32):
        a, b, c = _jacobian(part * x, part * y, k)
        undone &= (a > 0) & (a * c > b * b)
    return undone
