"""The trajectory integrator: closed forms, drag laws against each other, tracking, speed, and the paper's tables.

    ./run python benchmarks/flight.py [--quick]

"High-Fidelity Drone Simulation with Depth Camera Noise and Improved Air Drag Force Models", Appl. Sci. 2023, 13(19),
10631, sections 3 and 4. The paper gives no c_d1, k, b or mass, no radius of a circle and no size of a lemniscate: the
vehicle is depthsim's f450, k and b are those of hover, and the sizes are in the table.
"""

import sys
import time
from pathlib import Path

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks import flight_fit
from benchmarks.flight_laws import READING, figure_16, table_2, track
from benchmarks.measuring import machine
from depthsim.flight.constants import GRAVITY
from depthsim.flight.drag import LAWS
from depthsim.flight.dynamics import BODY, Motion, simulate
from depthsim.flight.fleet import make_fleet
from depthsim.flight.paths import Circle, Hover, Lemniscate
from depthsim.flight.reference import make_reference
from depthsim.flight.vehicle import Vehicle, load_vehicle
from depthsim.flight.wind import make_air
from depthsim.parallel import core_count
from depthsim.trajectory.rotation import rotation_matrices

Floats = NDArray[np.float64]

STEP = 1e-3
PAPER_EVALUATION = 4.36e-6
AREAS = {"area": [0.05, 0.06, 0.2]}
KEYS = {
    "linear": {"D": [0.3, 0.2, 0.1]},
    "airsim_quadratic": AREAS,
    "body_quadratic": AREAS,
    "thrust_difference": {"c": 0.01},
    "none": {},
}


def main(quick: bool = typer.Option(False, help="Fewer vehicles, and no flights of others.")) -> None:
    """Print every table."""
    console = Console(width=130)
    console.print(machine())
    for table in (closed_forms(), orders(), tracking(), figure_16(), table_2(), evaluations(), speeds(quick)):
        console.print(table)
    console.print(READING)
    if not quick:
        flight_fit.main()


def craft(**changes: object) -> Vehicle:
    return Vehicle.model_validate({**load_vehicle("f450").model_dump(), **changes})


def drift(vehicle: Vehicle, thrust: float | list[float], seconds: float, step: float = STEP, **start: Floats) -> Motion:
    """A flight with constant thrusts, from a state at rest but for what is given."""
    y = np.zeros(BODY + 4)
    y[9] = 1
    for name, part in {"v": slice(3, 6), "w": slice(10, 13)}.items():
        y[part] = start.get(name, 0)
    commands = np.broadcast_to(np.asarray(thrust, np.float64), (1, 4)).copy()
    y[BODY:] = commands[0] if "v" not in start else 3.4
    steps = round(seconds / step)
    return simulate(
        make_fleet([vehicle]), make_air(None), y[None], step=step, steps=steps, every=steps, commands=commands
    )


def closed_forms() -> Table:
    table = Table("what", "simulated", "closed form", "relative", "at most", "", title="Against closed forms, SI units")

    def row(what: str, found: float, wanted: float) -> None:
        off = abs(found / wanted - 1)
        table.add_row(what, f"{found:.9f}", f"{wanted:.9f}", f"{off:.1e}", "1e-6", "yes" if off <= 1e-6 else "no")

    none = {"law": "none"}
    linear = craft(drag={"law": "linear", "D": [0.3, 0.3, 2.0]})
    fall = drift(linear, 0, 30).states[0, -1, 5]
    row("terminal velocity, Eq. 5, D_z 2 N/(m/s)", -fall, linear.weight / 2.0)
    box = craft(drag={"law": "airsim_quadratic", "area": [0.05, 0.05, 0.2]})
    fall = drift(box, 0, 120).states[0, -1, 5]
    row("terminal velocity, AirSim's code, 0.2 m²", -fall, float(np.sqrt(2 * box.weight / (1.225 * 0.325 * 0.2))))
    vehicle = load_vehicle("f450")
    hover = make_reference(Hover(time=15), vehicle)
    hover.start[:3] += [0.5, -0.3, 0.2]
    row("hover thrust, after a push off by 0.6 m", track(vehicle, hover).states[0, -1, BODY:].sum(), vehicle.weight)
    row("free fall of 5 s", -drift(craft(drag=none), 0, 5).states[0, -1, 2], GRAVITY * 12.5)
    free = craft(drag=none)
    q = drift(free, 0, 1, w=np.array([0, 0, 2.5])).states[0, -1, 6:10]
    row("turn at a constant 2.5 rad/s, after 1 s", float(2 * np.arctan2(q[2], q[3])), 2.5)
    turn = make_reference(Circle(radius=8, speed=6, laps=4), free)
    y = track(free, turn).states[0, len(turn.rows) // 2]
    lateral = float(np.sum(y[3:5] ** 2) / np.hypot(y[0], y[1]))
    row("level turn r 8 m, 6 m/s: thrust", y[BODY:].sum(), free.mass * np.hypot(GRAVITY, lateral))
    bank = float(np.arccos(rotation_matrices(y[None, 6:10])[0, 2, 2]))
    row("level turn: bank", bank, float(np.arctan2(lateral, GRAVITY)))
    row("level turn: rate", float(np.linalg.norm(y[10:13])), float(np.hypot(y[3], y[4]) / np.hypot(y[0], y[1])))
    return table


def orders() -> Table:
    table = Table("law", "1/50 s", "1/100 s", "1/200 s", "1/400 s", "order", "at least", title="Order by step halving")
    for name in LAWS:
        vehicle = craft(drag={"law": name, **KEYS.get(name, {"c_d1": 0.05})})

        def end(step: float, vehicle: Vehicle = vehicle) -> Floats:
            start = {"v": np.array([9.0, 8, 12]), "w": np.array([0.5, -0.6, 0.4])}
            return drift(vehicle, [4, 3.6, 3.5, 3.7], 0.4, step, **start).states[0, -1]

        exact = end(1 / 3200)
        errors = [float(np.abs(end(1 / rate) - exact).max()) for rate in (50, 100, 200, 400)]
        order = np.log2(errors[1] / errors[2])
        table.add_row(name, *(f"{error:.1e}" for error in errors), f"{order:.2f}", "4" if order > 3.95 else "4 no")
    table.caption = "Tumbling in a curve, motors lagging; no axis turns against the air, where |v| v has a kink."
    return table


def tracking() -> Table:
    table = Table(
        "vehicle",
        "path",
        "RMS with m",
        "without m",
        "times smaller",
        "at least",
        title="Drag feed-forward, tracking error",
    )
    for name in ("f450", "hummingbird", "racer250"):
        vehicle, path = load_vehicle(name), Lemniscate(size=(40, 20), speed=10)
        errors = []
        for feedforward in (True, False):
            reference = make_reference(path, vehicle, feedforward=feedforward)
            off = track(vehicle, reference).states[0, :, :3] - reference.rows[:, :3]
            errors.append(float(np.sqrt(np.mean(np.sum(off**2, axis=1)))))
        ratio = errors[1] / errors[0]
        told = "lemniscate 40 x 20 m, 10 m/s"
        table.add_row(name, told, f"{errors[0]:.4f}", f"{errors[1]:.4f}", f"{ratio:.0f}", "3" if ratio >= 3 else "3 no")
    return table


def evaluations() -> Table:
    table = Table("law", "equation", "ns", "paper ns", "times faster", title="One drag evaluation")
    rng = np.random.default_rng(0)
    count = 20_000
    air, rates, thrusts = rng.normal(size=(count, 3)), rng.normal(size=(count, 3)), rng.uniform(1, 8, (count, 4))
    for name, law in LAWS.items():
        vehicle = craft(drag={"law": name, **KEYS.get(name, {"c_d1": 0.05})})
        seconds = best(lambda vehicle=vehicle: vehicle.drag.force(vehicle, air, rates, thrusts), 50) / count
        table.add_row(
            name,
            law.equation,
            f"{seconds * 1e9:.1f}",
            f"{PAPER_EVALUATION * 1e9:.0f}",
            f"{PAPER_EVALUATION / seconds:.0f}",
        )
    table.caption = "The paper's 4.36e-6 s is on its own machine, and its law is Eq. 13."
    return table


def speeds(quick: bool) -> Table:
    table = Table(
        "vehicles", "seconds flown", "wall s", "times real time", "µs a vehicle and step", "at most s",
        title=f"Flights at 1 kHz, RK4 with the controller, {core_count()} threads",
    )  # fmt: skip
    vehicle = load_vehicle("f450")
    path = Lemniscate(size=(40, 20), speed=10, laps=3.2)
    reference = make_reference(path, vehicle)
    sixty = best(lambda: make_reference(path, vehicle), 3)
    fleets = (1, 10, 100) if quick else (1, 10, 100, 1000)
    for count in fleets:
        fleet, air = make_fleet([vehicle] * count), make_air(None, range(count))
        starts = np.tile(reference.start, (count, 1))
        every = 1 if count == 1 else 100

        def work(fleet=fleet, air=air, starts=starts, every=every) -> None:
            simulate(fleet, air, starts, step=STEP, steps=60_000, every=every, references=reference.rows[None])

        seconds = best(work, 3 if count <= 100 else 1)
        aim = "" if count > 1 else "0.3 yes" if seconds < 0.3 else "0.3 no"
        table.add_row(
            str(count), "60", f"{seconds:.3f}", f"{60 * count / seconds:.0f}", f"{seconds / count / 0.06:.2f}", aim
        )
    table.add_row("", "60", f"{sixty:.3f}", "", "", "the reference, once")
    return table


def best(work: object, rounds: int) -> float:
    """The least of some times [s], after one for the compiler."""
    assert callable(work)
    work()
    seconds = []
    for _ in range(rounds):
        begin = time.perf_counter()
        work()
        seconds.append(time.perf_counter() - begin)
    return min(seconds)


if __name__ == "__main__":
    typer.run(main)
