"""How far the poses of a recording are off: in numbers, in words, and as an effect."""

from dataclasses import dataclass

import numpy as np

from depthsim.gap.depth.data.rigid import Floats
from depthsim.sensor.effects.pose_noise import PoseNoise

_SURE = 3.3
"""Standard errors: 1 in 1000."""
_ALONG = 0.5
"""Of the motions' squares: with more along the camera's own velocity, it is the times that are wrong."""
_FEW, _EXPLAINED = 3.0, 0.25
"""With fewer independent errors, more of which an offset and a scale of disparities explain, they may be a bias's."""
_REPEATED = 0.1
"""Of successive frames: with more that are the same, it is no chance."""


@dataclass(frozen=True)
class PoseErrors:
    """What is random in the poses, and what is constant; six numbers are about and along the camera's x, y, z.

    deviation: (6,) standard deviation, turn [rad] and shift [m]; NaN where the scene does not show it.
    error: (6,) standard error of ``deviation`` (of the square root of the variance's error, where that is 0).
    correlation_time: [s]; 0 where frames next to each other are independent; NaN where nothing is random.
    pooled: the standard deviation of a turn [rad] and of a shift [m], those about or along all axes together.
    pooled_error: their standard errors. correlation: between one frame and the next, and its standard error; step: the
    time between them [s].
    constant: (6,) what is alike in all frames, and is left in: a turned or shifted mount. late: [s] what the poses
    say is so much after the stamps; left in, too. Where they are no more than random errors leave on average they are
    taken for that, and removed. constant_error, late_error: their standard errors, large where the
    recording does not tell them apart from each other or from the camera's own errors. removed: of what rigid motions
    explain on one half of the pixels, the share that those found on the other half remove. along_motion: the share of
    the random motions' squares that lies along each frame's own velocity; of random ones that is about a sixth.
    of_disparity: what an offset and a scale of each frame's disparities explain, over what its motion does, both found
    on one half of the pixels for the other. Of a motion that is at most about 1.
    repeated: of successive frames at two poses, the share whose pictures are the same, pixel for pixel.
    of_frame: the standard errors of one frame's own turn [rad] about an axis and shift [m] along one, root mean square.
    independent: how many independent errors the frames show; fewer than there are frames where errors last.
    """

    deviation: Floats
    error: Floats
    pooled: tuple[float, float]
    pooled_error: tuple[float, float]
    correlation_time: float
    correlation: tuple[float, float]
    step: float
    constant: Floats
    constant_error: Floats
    late: float
    late_error: float
    removed: float
    along_motion: float = 0.0
    of_disparity: float = 0.0
    repeated: float = 0.0
    of_frame: tuple[float, float] = (0.0, 0.0)
    independent: float = np.inf

    @property
    def are_lasting(self) -> bool:
        """Whether they last as long as the recording, and are much like biases: so is what another bias leaves."""
        return not self.is_none and self.independent < _FEW and self.of_disparity > _EXPLAINED

    @property
    def are_of_time(self) -> bool:
        """Whether they are late or early rather than off: stamps that wander, or frames that are repeated."""
        return self.along_motion > _ALONG or self.are_repeated

    @property
    def are_repeated(self) -> bool:
        """Whether the camera's poses went on while its pictures did not."""
        return self.repeated > _REPEATED

    @property
    def are_of_disparity(self) -> bool:
        """Whether they are the sensor's: another offset and scale in each frame, which explain more than a motion."""
        return self.of_disparity > 1

    @property
    def are_of_others(self) -> bool:
        """Whether what differs from frame to frame is no error of the poses, or nobody knows."""
        return self.is_unknown or self.are_of_time or self.are_of_disparity or self.are_lasting

    @property
    def is_none(self) -> bool:
        """Whether no direction varies by more than chance."""
        return not np.nansum(self.deviation) > 0

    @property
    def is_unknown(self) -> bool:
        """Whether there are too few frames, or the scene shows no direction."""
        return bool(np.isnan(self.deviation).all())

    @property
    def turn(self) -> tuple[float, float, float] | None:
        """[deg] of the mount, about x, y and z; None where it may be by chance."""
        return self._of_mount(np.degrees(self.constant[:3]), slice(0, 3))

    @property
    def shift(self) -> tuple[float, float, float] | None:
        """[m] of the mount, along x, y and z; None where it may be by chance."""
        return self._of_mount(self.constant[3:], slice(3, 6))

    def _of_mount(self, values: Floats, which: slice) -> tuple[float, float, float] | None:
        """Some of the constant's ``values``, in any unit; None where they may all be by chance."""
        x, y, z = map(float, values)
        sure = np.abs(self.constant[which]) > _SURE * self.constant_error[which]
        return (x, y, z) if sure.any() else None

    @property
    def turn_by_chance(self) -> float:
        """How far the mount may seem turned by what random errors leave on average [deg]."""
        return float(np.degrees(_SURE * np.linalg.norm(self.constant_error[:3])))

    @property
    def shift_by_chance(self) -> float:
        """How far the mount may seem shifted by what random errors leave on average [m]."""
        return float(_SURE * np.linalg.norm(self.constant_error[3:]))

    @property
    def late_by_chance(self) -> float:
        """How late the stamps may seem by what random errors leave on average [s]."""
        return _SURE * self.late_error

    @property
    def rotation(self) -> float:
        """Standard deviation of a turn about an axis that the scene shows [deg]."""
        return float(np.degrees(self.pooled[0]))

    @property
    def translation(self) -> float:
        """Standard deviation of a shift along an axis that the scene shows [m]."""
        return self.pooled[1]

    def effect(self) -> PoseNoise:
        """The effect that puts a simulated camera where this one was, by the law of its errors."""
        time = float(f"{np.nan_to_num(self.correlation_time):.4g}")
        turn, shift = (float(f"{value:.4g}") for value in (self.rotation, self.translation))
        return PoseNoise(rotation=min(turn, 20.0), translation=min(shift, 0.5), correlation_time=time)

    def left(self, errors: float) -> PoseNoise:
        """What registered poses are off by: so many standard ``errors``."""
        turn, shift = errors * np.degrees(self.of_frame[0]), errors * self.of_frame[1]
        return PoseNoise(rotation=min(float(turn), 20.0), translation=min(float(shift), 0.5), correlation_time=0.0)

    def intervals(self, errors: float = 1.96) -> dict[str, tuple[float, float]]:
        """Of each parameter of :meth:`effect`, so many standard ``errors`` to either side.

        The correlation time's is that of the correlation with the next frame, as normal as Fisher's z has it.
        """
        found = {}
        for name, value, error, highest in zip(
            ("rotation", "translation"), (self.rotation, self.translation),
            (np.degrees(self.pooled_error[0]), self.pooled_error[1]), (20.0, 0.5), strict=True,
        ):  # fmt: skip
            found[name] = (max(float(value - errors * error), 0.0), min(float(value + errors * error), highest))
        if not self.is_none:
            middle, half = np.arctanh(min(self.correlation[0], 0.999)), errors * self.correlation[1]
            low, high = (np.clip(np.tanh(middle + sign * half), 0, 1 - 1e-9) for sign in (-1, 1))
            times = [float(-self.step / np.log(law)) if law > 0 else 0.0 for law in (low, high)]
            found["correlation_time"] = (min(times[0], 1e4), min(times[1], 1e4))
        return found

    @property
    def text(self) -> str:
        """As it is told: ``poses off by 3.1 mm and 0.40 deg per frame, correlated over 0.5 s``."""
        if self.is_none:
            return "the poses are not off by more than chance from frame to frame"
        time = f", correlated over {self.correlation_time:.2g} s" if self.correlation_time > 0 else ""
        return f"poses off by {1e3 * self.translation:.2g} mm and {self.rotation:.2g} deg per frame{time}"
