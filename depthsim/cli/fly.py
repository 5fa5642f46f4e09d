"""`depthsim fly`: a flight along a path, with the camera on board."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from depthsim.cli.options import Tags, Units, Up, parse_tags
from depthsim.errors import InputError

if TYPE_CHECKING:
    from depthsim.flight.flying import Flight


def fly(
    path: Annotated[
        str,
        typer.Argument(
            metavar="PATH_SPEC", help="A shape such as lemniscate:size=20/10,center=0/0/2, or a .yaml file."
        ),
    ],
    out: Annotated[Path, typer.Option(help="The flight's folder.")],
    vehicle: Annotated[str, typer.Option(help="f450, hummingbird, racer250, crazyflie, or a vehicle.yaml.")] = "f450",
    speed: Annotated[float | None, typer.Option(help="The greatest along the path [m/s].")] = None,
    wind: Annotated[
        str | None, typer.Option(help="3/0/0 [m/s], gusts:velocity=6/0/0, shear:velocity=8/0/0, .yaml, or a .csv grid.")
    ] = None,
    feedforward: Annotated[
        bool, typer.Option("--feedforward/--no-feedforward", help="Whether the controller knows of the drag.")
    ] = True,
    scene: Annotated[
        str | None, typer.Option(help="What the flight must not touch: the first contact is reported.")
    ] = None,
    ground: Annotated[float | None, typer.Option(help="Height of level ground, for the ground effect [m].")] = None,
    imu_rate: Annotated[int, typer.Option(help="Of the gyroscope: 200 or 400 Hz.")] = 200,
    seed: Annotated[int, typer.Option(min=0, help="Of gusts and IMU; the same seed gives the same bytes.")] = 0,
    tag: Tags = None,
    units: Units = None,
    up: Up = None,
) -> None:
    """Fly a path: flight.csv, groundtruth.txt, imu.csv and vehicle.yaml, for `depthsim generate --fly`."""
    from depthsim.flight.flying import fly as take_off
    from depthsim.flight.flying import refuse_run
    from depthsim.flight.imu import GYRO_RATES
    from depthsim.scenefile import load_scene

    if imu_rate not in GYRO_RATES:
        raise InputError("--imu-rate", str(imu_rate), "is no rate of the gyroscope", "give 200 or 400")
    refuse_run(out)
    flight = take_off(
        path,
        vehicle,
        speed=speed,
        wind=wind,
        feedforward=feedforward,
        scene=load_scene(scene, tags=parse_tags(tag), units=units, up=up) if scene else None,
        ground=ground,
        seed=seed,
        gyro_rate=imu_rate,
        name=path,
    )
    flight.write(out)
    _show(flight, out)


def _show(flight: "Flight", out: Path) -> None:
    """A line of what was flown; a contact with the scene goes to stderr."""
    import numpy as np

    log = flight.log
    fastest = float(np.linalg.norm(log.velocity, axis=1).max())
    error = float(np.sqrt(np.mean(flight.error**2)))
    print(
        f"{out}: {log.duration:.2f} s on {flight.vehicle.name}, up to {fastest:.2f} m/s, "
        f"{error:.3f} m from the path (RMS), {flight.error.max():.3f} m at most"
    )
    if flight.contact is not None:
        print(f"{out}: the flight {flight.contact}; it goes on as if nothing were there", file=sys.stderr)
