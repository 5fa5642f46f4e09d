"""One frame on its way through the sensor."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.materials import Materials
from depthsim.parallel import split
from depthsim.raycast import Geometry
from depthsim.scene import NO_TAG, Scene
from depthsim.sensor.draws import Draws
from depthsim.sensor.motion import Motion


@dataclass
class Frame:
    """What an effect sees and changes.

    depth: (height, width) float32, the depth as measured so far [m]; 0 is no return. Effects change it in place.
    geometry: what the rays met, for effects that depend on range, incidence, material or visibility.
    index, stamp: which frame of the run it is, and when it was taken [s].
    motion: where the camera is, in time.
    """

    depth: NDArray[np.float32]
    geometry: Geometry
    camera: Camera
    scene: Scene
    materials: Materials
    motion: Motion
    seed: int = 0
    index: int = 0
    stamp: float = 0.0
    threads: int = 1
    _used: dict[str, int] = field(default_factory=dict)

    def draws(self, name: str) -> Draws:
        """Random numbers of one effect. An effect that stands twice in a profile draws anew the second time."""
        turn = self._used[name] = self._used.get(name, 0) + 1
        return Draws(self.seed, name if turn == 1 else f"{name}#{turn}", self.index, self.threads)

    def run(self, kernel: Callable[..., None], *arguments: object, multiple: int = 1) -> None:
        """Call ``kernel(start, stop, *arguments)`` on parts of the frame's pixels, on the frame's threads."""
        split(kernel, self.depth.size, self.threads, *arguments, multiple=multiple)

    def by_tag(self, values: dict[str, float]) -> NDArray[np.float32]:
        """(256,) float32: a value for each tag index of the scene, 0 for no tag; look up with ``geometry.tag``."""
        table = np.zeros(NO_TAG + 1, np.float32)
        table[: len(self.scene.tags)] = [values[tag] for tag in self.scene.tags]
        return table
