"""One frame on its way through the sensor."""

from collections.abc import Callable, Iterator
from typing import Any, Protocol

import numpy as np
from numpy.typing import DTypeLike, NDArray

from depthsim.camera import Camera
from depthsim.draws import Draws, Seed
from depthsim.kernels import kernel
from depthsim.materials import Materials
from depthsim.parallel import split
from depthsim.raycast import Geometry
from depthsim.scene import NO_TAG
from depthsim.scratch import Scratch
from depthsim.sensor.motion import Motion
from depthsim.sensor.noise_field import Correlation, Fields, noise_field

_KEPT = 2
"""How many pictures of noise are kept of a frame."""
_MOST = np.finfo(np.float32).max


@kernel
def _invert(start, stop, focal_baseline, given, wanted):
    """Depth to disparity, or back: f·b / x, at most what a number can be; what is not positive becomes 0, a hole."""
    # Slices, because an index that is plainly not negative is what lets the compiler use the vector unit.
    x, y = given[start:stop], wanted[start:stop]
    for i in range(x.size):
        value = min(focal_baseline / x[i], _MOST)
        y[i] = value if x[i] > np.float32(0) else np.float32(0)


@kernel
def _add_noise(start, stop, variance, noise, disparity):
    """Holes stay holes, and where the noise puts the surface beyond infinity there is a hole."""
    d, var, unit = disparity[start:stop], variance[start:stop], noise[start:stop]
    for i in range(d.size):
        noisy = max(d[i] + np.sqrt(var[i]) * unit[i], np.float32(0))
        d[i] = noisy if d[i] > np.float32(0) else np.float32(0)


class Surfaces(Protocol):
    """What effects ask of a scene. tags: of its materials. normals: (faces, 3) float32 unit normals in the world."""

    @property
    def tags(self) -> tuple[str, ...]:
        """The names that the tags of a :class:`~depthsim.raycast.Geometry` count."""

    @property
    def normals(self) -> NDArray[np.float32]:
        """By face."""


class Frame:
    """What an effect sees and changes.

    geometry: what the rays met, for effects that depend on range, incidence, material or visibility.
    index, stamp: which frame of the run it is, and when it was taken [s].
    motion: where the camera is, in time.
    correlation: how the noise of all effects is correlated between pixels and frames.
    before: gives so many of the frames before this one, see :meth:`earlier`.
    reached: says which pixels, (height, width) uint8, show what light from a direction in the world reaches, which is
        (3,) a unit vector towards it; None where there is no scene that could hide it.
    """

    before: Callable[[int], Iterator["Frame"]] | None = None
    reached: Callable[[NDArray[np.float32]], NDArray[np.uint8]] | None = None

    def __init__(
        self,
        depth: NDArray[np.float32],
        geometry: Geometry,
        camera: Camera,
        scene: Surfaces,
        materials: Materials,
        motion: Motion,
        seed: int | Seed = 0,
        index: int = 0,
        stamp: float = 0.0,
        threads: int = 1,
        scratch: Scratch | None = None,
        fields: Fields | None = None,
    ) -> None:
        self.geometry, self.camera, self.scene, self.materials, self.motion = geometry, camera, scene, materials, motion
        self.seed, self.index, self.stamp, self.threads = seed, index, stamp, threads
        self.correlation = Correlation()
        self._scratch, self._fields = scratch or Scratch(), fields
        self._depth = depth
        self._disparity: NDArray[np.float32] | None = None
        self._is_disparity = False
        self._variance: NDArray[np.float32] | None = None
        self._gain: NDArray[np.float32] | None = None
        self._used: dict[str, int] = {}

    @property
    def depth(self) -> NDArray[np.float32]:
        """(height, width) float32: the depth as measured so far [m], 0 is a hole. Effects change it in place.

        Depth and disparity are two ways to see one measurement, of which the one that was asked for last counts: ask
        again after the other was used.
        """
        self._draw_noise()
        if self._is_disparity and self._disparity is not None:
            self._convert(self._disparity, self._depth)
        self._is_disparity = False
        return self._depth

    @property
    def disparity(self) -> NDArray[np.float32]:
        """(height, width) float32: the same as disparity f·b / depth [px], 0 is a hole, to be changed in place."""
        self._draw_noise()
        return self._as_disparity()

    def earlier(self, count: int) -> Iterator["Frame"]:
        """Up to ``count`` frames before this one, the first one first, as they came to the effect that asks.

        Each is good until the next. Before frame 0 there are none. What they were cast from is not known any more.
        """
        return self.before(count) if self.before is not None else iter(())

    def resize(self, depth: NDArray[np.float32], camera: Camera, geometry: Geometry) -> None:
        """Put another picture in the place of this one. depth: [m], of the shape of ``camera``, kept.

        geometry: what its pixels show; an empty one where that is not known.
        """
        self._depth, self._disparity, self._is_disparity = depth, None, False
        self.camera, self.geometry = camera, geometry

    @property
    def noise_variance(self) -> NDArray[np.float32]:
        """(height, width) float32: variance of the disparity's noise that is not drawn yet [px²], to be added to.

        The sum of independent normal noises is one of the summed variance, so all effects share one picture of noise;
        it is drawn when the depth or the disparity is asked for.
        """
        if self._variance is None:
            self._variance = self.empty()
            self._variance.fill(0)
        return self._variance

    @property
    def noise_gain(self) -> NDArray[np.float32]:
        """(height, width) float32: what the std of every noise that is not drawn yet is multiplied by; 1 at first."""
        if self._gain is None:
            self._gain = self.empty()
            self._gain.fill(1)
        return self._gain

    @property
    def has_noise_gain(self) -> bool:
        """Whether some effect has asked for :attr:`noise_gain`."""
        return self._gain is not None

    @property
    def keeps_noise(self) -> bool:
        """Whether :meth:`unit_noise` keeps what it draws, for other sensors that see the same frame."""
        return self._fields is not None

    def _draw_noise(self) -> None:
        if self._variance is not None:
            variance, self._variance = self._variance.reshape(-1), None
            noise = self.unit_noise("noise of the disparity").reshape(-1)
            if self._gain is not None:
                noise *= self._gain.reshape(-1)
            self.run(_add_noise, variance, noise, self._as_disparity().reshape(-1))

    def _as_disparity(self) -> NDArray[np.float32]:
        if self._disparity is None:
            self._disparity = self.empty()
        if not self._is_disparity:
            self._convert(self._depth, self._disparity)
        self._is_disparity = True
        return self._disparity

    def _convert(self, given: NDArray[np.float32], wanted: NDArray[np.float32]) -> None:
        self.run(_invert, np.float32(self.camera.focal_baseline), given.reshape(-1), wanted.reshape(-1))

    def empty(self, dtype: DTypeLike = np.float32, shape: tuple[int, ...] | None = None) -> NDArray[Any]:
        """(height, width) with arbitrary content, for an effect to write; it is good until the frame is finished."""
        return self._scratch.empty(shape or self._depth.shape, dtype)

    def draws(self, name: str) -> Draws:
        """Random numbers of one effect. An effect that stands twice in a profile draws anew the second time."""
        turn = self._used[name] = self._used.get(name, 0) + 1
        return Draws(self.seed, name if turn == 1 else f"{name}#{turn}", self.index, self.threads, self._scratch)

    def unit_noise(self, name: str) -> NDArray[np.float32]:
        """(height, width) float32: the noise of one effect, normal with mean 0 and variance 1 at every pixel.

        It is correlated between pixels and frames as ``correlation`` says; the noise of another effect is independent.
        """
        draws, shape = self.draws(name), self.camera.shape
        if self._fields is None:
            return noise_field(draws, shape, self.correlation, self.threads)
        key = draws.key.tobytes(), draws.frame, shape, self.correlation
        known = self._fields.pop(key, None)
        if known is None:
            known = noise_field(draws, shape, self.correlation, self.threads).copy()
        self._fields[key] = known
        for old in list(self._fields)[:-_KEPT]:
            self._fields.pop(old, None)  # another thread may have been here
        own: NDArray[np.float32] = self.empty(shape=shape)
        own[:] = known
        return own

    def run(self, kernel: Callable[..., None], *arguments: object, multiple: int = 1) -> None:
        """Call ``kernel(start, stop, *arguments)`` on parts of the frame's pixels, on the frame's threads."""
        split(kernel, self._depth.size, self.threads, *arguments, multiple=multiple)

    def by_tag(self, values: dict[str, float]) -> NDArray[np.float32]:
        """(256,) float32: a value for each tag index of the scene, 0 for no tag; look up with ``geometry.tag``."""
        table = np.zeros(NO_TAG + 1, np.float32)
        table[: len(self.scene.tags)] = [values[tag] for tag in self.scene.tags]
        return table
