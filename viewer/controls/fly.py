"""Flying: the sensor goes where the keys take the view, or a drone carries it on a path; speed and drag are shown."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import viser
from numpy.typing import NDArray

from depthsim.errors import InputError
from depthsim.flight.flying import Flight, fly
from depthsim.flight.pathspec import resolve_path
from depthsim.flight.vehicle import Vehicle, load_vehicle, vehicle_names
from depthsim.trajectory import Trajectory
from depthsim.trajectory.rotation import rotation_matrices
from viewer.controls.handles import picked, put
from viewer.stage import Stage

_SMOOTH = 0.25
"""[s] over which the speed of a flight by keys is averaged."""


@dataclass(frozen=True)
class Air:
    """velocity and drag in the world, (3,) [m/s] and [N]. weight: of the vehicle [N]."""

    velocity: NDArray[np.float64]
    drag: NDArray[np.float64]
    weight: float

    def __str__(self) -> str:
        drag = float(np.linalg.norm(self.drag))
        speed = float(np.linalg.norm(self.velocity))
        return f"speed {speed:.2f} m/s · drag {drag:.3f} N ({drag / self.weight:.1%} of the weight)"


class FlyControls:
    """Choices of the Fly tab, and the flight that was flown last."""

    def __init__(
        self, gui: viser.GuiApi, stage: Stage, changed: Callable[[], None], fly_path: Callable[[], None]
    ) -> None:
        self.flight: Flight | None = None
        self._track: list[tuple[float, NDArray[np.float64]]] = []
        gui.add_markdown("W A S D move, Q E sink and rise, the arrow keys turn; click into the view first.")
        self.keys = gui.add_checkbox("fly by keyboard", False, hint="The sensor is where you look from.")
        self.vehicle = gui.add_dropdown(
            "vehicle", list(vehicle_names()), initial_value="f450", hint="Whose drag is shown."
        )
        gui.add_markdown("Or along a path, flown by the vehicle with its controller and drag:")
        self._path = gui.add_text("path", _default_path(stage), hint="As `depthsim fly` takes it.")
        self._speed = gui.add_slider("greatest speed [m/s]", 0.5, 20.0, 0.5, 3.0)
        self._fly = gui.add_button("fly the path")
        self._back = gui.add_button("back to the trajectory", visible=False)
        self.said = gui.add_markdown("")
        self._fly.on_click(lambda _: fly_path())
        self._back.on_click(lambda _: self._land(changed))
        self.landed: Callable[[], None] = lambda: None
        self.keys.on_update(lambda _: changed())
        self.vehicle.on_update(lambda _: changed())

    def take_off(self, stage: Stage, rate: float) -> Trajectory:
        """Fly the path; the camera's poses at ``rate`` [Hz]. Raises :class:`~depthsim.errors.InputError`."""
        text = self._path.value.strip()
        if text.lower().endswith((".yaml", ".yml")):
            raise InputError("path", text[:60], "is a file", "give a shape in one line; `depthsim fly` takes files")
        path = resolve_path(text, float(self._speed.value))
        self.flight = fly(path, load_vehicle(picked(self.vehicle)), scene=stage.scene, name="path")
        put(self.keys, False)
        self._back.visible = True
        contact = self.flight.contact
        self.said.content = f"Careful: the flight {contact}." if contact else ""
        return self.flight.camera.sampled(rate)

    def _land(self, changed: Callable[[], None]) -> None:
        self.flight, self._back.visible, self.said.content = None, False, ""
        self.landed()
        changed()

    def along(self, stamp: float) -> Air | None:
        """Speed and drag on the flight at a stamp [s]; None without one."""
        if self.flight is None:
            return None
        log, vehicle = self.flight.log, self.flight.vehicle
        row = min(int(np.searchsorted(log.t, stamp)), len(log) - 1)
        rotation, thrusts = log.rotations[row], log.rotor_thrusts
        assert thrusts is not None
        return _air(vehicle, log.velocity[row], rotation, log.rates[row], thrusts[row])

    def by_keys(self, position: NDArray[np.float64]) -> Air:
        """Speed and drag of the chosen vehicle at a place where the keys have taken it now, flying level."""
        now = time.monotonic()
        self._track = [(t, p) for t, p in self._track if now - t < _SMOOTH] + [(now, np.asarray(position))]
        (begin, there), (_, here) = self._track[0], self._track[-1]
        velocity = (here - there) / (now - begin) if now - begin > 0.02 else np.zeros(3)
        vehicle = _vehicle(picked(self.vehicle))
        hover = np.full(vehicle.rotors.count, vehicle.weight / vehicle.rotors.count)
        return _air(vehicle, velocity, np.eye(3), np.zeros(3), hover)


@cache
def _vehicle(name: str) -> Vehicle:
    """One that comes with depthsim, read once."""
    return load_vehicle(name)


def _air(vehicle: Vehicle, velocity: NDArray, rotation: NDArray, rates: NDArray, thrusts: NDArray) -> Air:
    body = vehicle.drag.force(vehicle, (rotation.T @ velocity)[None], rates[None], thrusts[None])[0]
    return Air(np.asarray(velocity), np.asarray(rotation @ body), vehicle.weight)


def camera_pose(camera: viser.CameraHandle) -> NDArray[np.float64]:
    """(4, 4) of the browser's view: its axes are those of the optical frame, x right, y down, z forward."""
    w, x, y, z = camera.wxyz
    pose = np.eye(4)
    pose[:3, :3] = rotation_matrices(np.array([[x, y, z, w]]))[0]
    pose[:3, 3] = camera.position
    return pose


def _default_path(stage: Stage) -> str:
    """A figure of eight around the middle of the camera's path, as large as fits into it."""
    path = stage.trajectory.positions
    middle = (path.min(axis=0) + path.max(axis=0)) / 2
    across, along = np.clip(0.8 * (path.max(axis=0) - path.min(axis=0))[:2], 1.0, 20.0)
    center = "/".join(f"{value:.2f}" for value in middle)
    return f"lemniscate:size={across:.1f}/{along:.1f},center={center}"
