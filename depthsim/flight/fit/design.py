"""A flight as a linear model of its specific force, for every law at once."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from depthsim.errors import InputError
from depthsim.flight.fit.candidates import CANDIDATES
from depthsim.flight.fit.motion import Motion
from depthsim.flight.fit.sums import Sums
from depthsim.flight.fit.thrust import ThrustMap
from depthsim.flight.table import Floats
from depthsim.flight.vehicle import Vehicle


@dataclass(frozen=True)
class Design:
    """One flight as a linear model: y (n, A), the columns of every law (n, A, P), the nuisance's z (n, A)."""

    motion: Motion
    y: Floats
    z: Floats
    x: dict[str, Floats]

    @staticmethod
    def of(motion: Motion, vehicle: Vehicle, thrusts: Floats, scaled: bool) -> "Design":
        """``scaled``: take the axis z in, whose nuisance is the scale of the thrust."""
        axes = 3 if scaled else 2
        y = motion.force[:, :axes]
        z = np.ones_like(y)
        if scaled:
            z[:, 2] = motion.smooth(thrusts.sum(axis=1)) / vehicle.mass
        x = {law.name: law.columns(motion, vehicle, thrusts)[:, :axes] for law in CANDIDATES}
        return Design(motion, y, z, x)

    @property
    def speed(self) -> Floats:
        """(n,) low-passed lateral speed [m/s]."""
        return np.asarray(np.linalg.norm(self.motion.smooth(self.motion.velocity)[:, :2], axis=1))

    def sums(self, name: str, known: tuple[bool, ...]) -> Sums:
        """The block sums under a law, of its ``known`` coefficients."""
        return Sums.of_blocks(self.y, self.x[name][..., np.array(known, dtype=bool)], self.z, self.motion.rate)


def rotor_thrusts(motions: Sequence[Motion], vehicle: Vehicle, mapped: ThrustMap | None) -> tuple[list[Floats], str]:
    """(N, K) rotor thrusts [N] of each flight, and where they are from."""
    rotors = vehicle.rotors.count
    logs = [motion.log for motion in motions]
    for log in logs:
        given = log.rotor_thrusts.shape[1] if log.rotor_thrusts is not None else rotors
        if given != rotors:
            fix = "give the vehicle of this log as `vehicle`"
            raise InputError(log.source, "header", f"has T1 to T{given}, but {vehicle.name} has {rotors} rotors", fix)
        total = log.total_thrust
        if total is not None and not total.mean() > 0:
            raise InputError(log.source, "thrust", "is 0 or below on average", "write it in N, upwards is positive")
    if all(log.rotor_thrusts is not None for log in logs):
        return [log.rotor_thrusts for log in logs if log.rotor_thrusts is not None], "the log, rotor by rotor"
    totals = [log.total_thrust for log in logs]
    if all(total is not None for total in totals):
        return [np.tile(total[:, None] / rotors, rotors) for total in totals if total is not None], "the log, in all"
    if mapped is not None:
        found = []
        for motion in motions:
            specific = mapped.specific_thrusts(motion.log)
            scale = mapped.scale_of(motion)  # how much it was in all, the accelerometer knows better
            found.append(_fanned(specific, rotors) * vehicle.mass * scale)
        return found, "the thrust map"
    equal = vehicle.mass / rotors
    return [np.tile(motion.whole_force[:, 2:] * equal, rotors) for motion in motions], "the accelerometer"


def _fanned(specific: Floats, rotors: int) -> Floats:
    """The rotors of the log as those of the vehicle: in equal parts if it has another number of them."""
    return specific if specific.shape[1] == rotors else np.tile(specific.sum(axis=1, keepdims=True) / rotors, rotors)
