"""The geometry of one depth camera: intrinsics, distortion and stereo baseline."""

from collections.abc import Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
import yaml
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, PrivateAttr, model_validator

from depthsim.yamlfile import read_model


class Camera(BaseModel):
    """A pinhole or Brown-Conrady camera, as in camera.yaml.

    The optical frame is x right, y down, z forward. Pixel (u, v) is the sample at the centre of its cell: its ray is
    ((u - cx) / fx, (v - cy) / fy, 1), u and v counted from 0. Depth belongs to the left imager; the right imager
    sits at +baseline along x. A distortion that folds the image over (no ray for some pixel) is rejected.
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
    distortion: tuple[FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat, FiniteFloat] = Field(
        (0.0, 0.0, 0.0, 0.0, 0.0), description="Brown-Conrady k1, k2, p1, p2, k3, in OpenCV's order"
    )
    baseline: FiniteFloat = Field(gt=0, description="left to right imager [m]")
    depth_scale: FiniteFloat = Field(0.001, gt=0, description="metres per unit of the 16-bit depth")
    rate: FiniteFloat = Field(30.0, gt=0, description="frames per second [Hz]")

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
        """A copy with other values, checked like any camera; pydantic's own would keep the rays of the old one."""
        return Camera.model_validate({**self.model_dump(), **(update or {})})

    def _fields(self) -> tuple[object, ...]:
        return tuple(getattr(self, name) for name in type(self).model_fields)

    # pydantic would compare the arrays that cached properties leave in __dict__, too.
    def __eq__(self, other: object) -> bool:
        return isinstance(other, Camera) and self._fields() == other._fields()

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
        """f·b [px m]: depth is this over disparity (Eq. 2 of the paper)."""
        return self.fx * self.baseline

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
        keys = self.model_dump(mode="json", exclude=None if any(self.distortion) else {"distortion"})
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
            x, y = _newton(x + xd / 8, y + yd / 8, part * xd, part * yd, k, most=2 if part < 1 else 20)
        ex, ey = distort(x, y, k)
        wrong = ~(np.hypot(ex - xd, ey - yd) < 1e-9)
    x[wrong] = y[wrong] = np.nan
    return x, y


def _newton(
    x: NDArray, y: NDArray, xd: NDArray, yd: NDArray, k: tuple[float, ...], most: int
) -> tuple[NDArray, NDArray]:
    """The root of distort(x, y) = (xd, yd) near (x, y), in at most ``most`` steps."""
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
