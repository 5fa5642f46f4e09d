"""What the live sensor of one browser is made of, and the frames that it measures."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.sensor import Profile, Sensor
from depthsim.sensor.motion import Motion
from viewer.shot import Shot
from viewer.stage import Stage


@dataclass(frozen=True)
class Moment:
    """When and where a frame is taken. index: its number, which keys the random numbers. pose: (4, 4)."""

    index: int
    stamp: float
    pose: NDArray[np.float64]
    motion: Motion | None


class LiveSensor:
    """A profile, a camera and a seed over the stage's scene; the sensor is kept while they stay the same."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._made: tuple[Profile, Camera, Sensor] | None = None

    def measure(self, profile: Profile, camera: Camera, seed: int, moment: Moment) -> Shot:
        """One frame. Raises :class:`~depthsim.errors.InputError` for a profile that cannot be."""
        if self._stage.caster is None:
            raise ValueError("there is no scene to measure in")
        if self._made is None or self._made[:2] != (profile, camera):
            sensor = Sensor(self._stage.caster, camera, profile, self._stage.materials)
            self._made = profile, camera, sensor
        measured = self._made[2].measure(
            moment.pose, index=moment.index, stamp=moment.stamp, seed=seed, motion=moment.motion
        )
        clean, whose = measured.clean, self._stage.instances(measured.clean.face)
        return Shot(measured.camera, moment.pose, measured.depth_raw, clean.depth, clean.tag, whose)


def recorded(stage: Stage, index: int) -> Shot:
    """A frame of the recording, with the scene's own depth beside it where there is a scene or clean/."""
    run = stage.run
    assert run is not None
    pose, units = run.poses[index], run.depth_raw(index)
    if stage.caster is not None:
        geometry = stage.caster.cast(run.camera, pose, stamps=float(run.stamps[index]))
        whose = run.instance(index) if run.has("instance") else stage.instances(geometry.face)
        return Shot(run.camera, pose, units, geometry.depth, geometry.tag, whose)
    return Shot(run.camera, pose, units, run.clean(index), run.material(index), run.instance(index))


def without_sensor(shot: Shot) -> Shot:
    """The same frame as a perfect camera has it; ``shot`` must know its clean depth."""
    assert shot.clean is not None
    stored = np.minimum(np.rint(shot.clean / np.float32(shot.camera.depth_scale)), 65535).astype(np.uint16)
    return replace(shot, depth_raw=stored)
