"""A flight in a YAML file, and what a camera needs of a flight: one that was flown, or one to fly now."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict

from depthsim.errors import InputError
from depthsim.flight.contact import Contact
from depthsim.flight.flying import FILES, Flight, fly
from depthsim.flight.paths import Path as FlightPath
from depthsim.flight.pathspec import parse_path, resolve_path
from depthsim.flight.vehicle import Vehicle, load_vehicle
from depthsim.flight.wind import Wind
from depthsim.flight.windfile import parse_wind, resolve_wind
from depthsim.runs.storing import write_whole
from depthsim.scene import Scene
from depthsim.trajectory.poses import Trajectory
from depthsim.trajectory.tum import read_tum
from depthsim.yamlfile import beside, read_model


class FlightSpec(BaseModel):
    """The keys of a flight's YAML file: those of `depthsim fly`."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    path: dict[str, Any] | str
    vehicle: str = "f450"
    speed: float | None = None
    wind: dict[str, Any] | str | None = None
    feedforward: bool = True
    ground: float | None = None
    seed: int = 0
    imu_rate: Literal[200, 400] = 200


@dataclass(frozen=True)
class Ride:
    """The camera's poses on a flight, and how to put the flight's other files into a run's folder."""

    camera: Trajectory
    write: Callable[[Path], None]
    contact: Contact | None = None


@dataclass(frozen=True)
class Planned:
    """What a flight's YAML file says, with the files that it names read."""

    spec: FlightSpec
    path: FlightPath
    vehicle: Vehicle
    wind: Wind | None


def read_flight_spec(file: Path) -> Planned:
    """Read a flight's YAML file; files that it names lie in its folder. Raises :class:`InputError`."""
    spec = read_model(FlightSpec, file, "a flight")
    vehicle = beside(file, spec.vehicle, "vehicle") if spec.vehicle.endswith((".yaml", ".yml")) else spec.vehicle
    inline = isinstance(spec.path, dict)
    path = parse_path(spec.path, file, "path", spec.speed) if inline else _named_path(spec, file)
    wind: Wind | None = None
    if isinstance(spec.wind, dict):
        wind = parse_wind(spec.wind, file, "wind")
    elif spec.wind is not None:
        wind = resolve_wind(str(beside(file, spec.wind, "wind")) if _is_file(spec.wind) else spec.wind)
    return Planned(spec, path, load_vehicle(vehicle), wind)


def fly_spec(file: Path, scene: Scene | None = None) -> Flight:
    """Fly what a YAML file says; files that it names lie in its folder."""
    planned = read_flight_spec(file)
    spec = planned.spec
    return fly(
        planned.path,
        planned.vehicle,
        wind=planned.wind,
        feedforward=spec.feedforward,
        scene=scene,
        ground=spec.ground,
        seed=spec.seed,
        gyro_rate=spec.imu_rate,
        name=str(file),
    )


def open_ride(choice: Path, scene: Scene | None = None) -> Ride:
    """The ride on a flight's folder, as `depthsim fly` writes it, or on a flight's YAML file, flown now."""
    if choice.suffix.lower() in (".yaml", ".yml"):
        flight = fly_spec(choice, scene)
        return Ride(flight.camera, lambda out: flight.write(out, poses=False), flight.contact)
    if not choice.is_dir():
        fix = "give the folder that `depthsim fly` wrote, or a flight's .yaml file"
        raise InputError(choice, "", "is no flight", fix)
    camera = read_tum(choice / "groundtruth.txt")

    def copy(out: Path) -> None:
        for name in FILES[:-1]:
            if (choice / name).is_file():
                write_whole(out / name, (choice / name).read_bytes())

    return Ride(camera, copy)


def _named_path(spec: FlightSpec, file: Path) -> Any:
    name = str(spec.path)
    return resolve_path(str(beside(file, name, "path")) if _is_file(name) else name, spec.speed)


def _is_file(name: str) -> bool:
    return Path(name).suffix.lower() in (".yaml", ".yml", ".csv")
