"""From a vehicle to the settings of the model, and from settings back to a vehicle that can be flown."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from depthsim.flight.drag import (
    BODY_QUADRATIC,
    LINEAR,
    QUADRATIC,
    ROTOR_SQRT,
    THRUST_DIFFERENCE,
    AirsimQuadratic,
    AnyDragLaw,
    BodyQuadratic,
    DragLaw,
    Linear,
    NoDrag,
    RotorSqrt,
    ThrustDifference,
)
from depthsim.flight.measurement import Measurement
from depthsim.flight.vehicle import Vehicle
from depthsim.flight.wind import Shear
from depthsim.gap.diagnosis import rounded
from depthsim.gap.flight.data.simulate import Law, Settings


def base_settings(vehicle: Vehicle, seconds: Sequence[float]) -> Settings:
    """What the vehicle file knows of. seconds: of each log."""
    laws: dict[str, Law] = {}
    for law in vehicle.drag_laws:
        for slot, parameters in _slots(law, vehicle):
            name = slot if slot not in laws else f"{slot} {len(laws)}"
            laws[name] = (law.code, parameters)
    recorder = vehicle.measurement
    sheared = vehicle.wind if isinstance(vehicle.wind, Shear) else None
    mean = sheared.velocity if sheared else vehicle.wind.mean if vehicle.wind else (0, 0, 0)
    return Settings(
        mass=vehicle.mass,
        scales=vehicle.rotors.scales,
        seconds=tuple(seconds),
        laws=laws,
        wind=(float(mean[0]), float(mean[1]), float(mean[2])),
        shear=(sheared.height, sheared.exponent) if sheared else None,
        offset=recorder.thrust_offset,
        fade=recorder.thrust_fade,
        lag=vehicle.rotors.motor_time_constant if recorder.thrust == "command" else 0.0,
        ground=vehicle.ground_effect,
        bias=_biases(recorder, seconds),
        rotation=recorder.imu_rotation,
        delays={recorder.late: recorder.time_offset} if recorder.time_offset else {},
    )


def _biases(recorder: Measurement, seconds: Sequence[float]) -> tuple[float, ...]:
    if not any(recorder.imu_drift):
        return recorder.imu_bias * len(seconds)
    ends = [
        [bias + at * drift for bias, drift in zip(recorder.imu_bias, recorder.imu_drift, strict=True)]
        for length in seconds
        for at in (0.0, length)
    ]
    return tuple(value for end in ends for value in end)


def _slots(law: DragLaw, vehicle: Vehicle) -> list[tuple[str, tuple[float, float, float]]]:
    x, y, z = (float(value) for value in law.parameters(vehicle))
    if isinstance(law, NoDrag):
        return []
    if isinstance(law, Linear):
        found = [("rotor", (x, y, 0.0))] if x or y else []
        return [*found, ("vertical", (0.0, 0.0, z))] if z else found
    if isinstance(law, (AirsimQuadratic, BodyQuadratic)):
        return [("body", (x, y, z))]
    return [("difference" if isinstance(law, ThrustDifference) else "rotor", (x, y, z))]


def with_settings(vehicle: Vehicle, s: Settings, gusts: dict[str, Any] | None) -> Vehicle:
    """The vehicle with the settings that effects have changed; drag below zero, which no law has, becomes none."""
    base = base_settings(vehicle, s.seconds)
    keys = vehicle.model_dump()
    keys["name"] = f"{vehicle.name}, diagnosed"
    if (s.laws, s.inflow) != (base.laws, base.inflow):
        laws = _laws(vehicle, base, s)
        keys["drag"], keys["more_drag"] = (laws or [{"law": "none"}])[0], laws[1:]
    if s.mass != base.mass:
        keys["mass"] = rounded(s.mass)
    if s.scales != base.scales:
        scales = rounded(list(s.scales))
        keys["rotors"]["thrust_scale"] = scales[0] if len(set(scales)) == 1 else scales
    if s.ground != base.ground and s.ground is not None:
        keys["ground_effect"] = {
            "law": s.ground.law, "strength": rounded(s.ground.strength), "height": rounded(s.ground.height),
        }  # fmt: skip
    if gusts is not None:
        keys["wind"] = {"kind": "gusts", **gusts}
    elif (s.wind, s.shear) != (base.wind, base.shear):
        keys["wind"] = {"kind": "constant", "velocity": rounded(list(s.wind))}
        if s.shear is not None:
            keys["wind"] |= {"kind": "shear", "height": rounded(s.shear[0]), "exponent": rounded(s.shear[1])}
    _measured(keys, base, s)
    limits = keys["rotors"]
    if s.mass * 9.81 >= (limits["max_thrust"] or 1e9) * limits["count"]:
        limits["max_thrust"] = None
    return Vehicle.model_validate(keys)


def _measured(keys: dict[str, Any], base: Settings, s: Settings) -> None:
    recorder = keys["measurement"]
    if s.lag != base.lag:
        keys["rotors"]["motor_time_constant"] = rounded(s.lag)
        recorder["thrust"] = "command"
    if s.bias != base.bias:
        begin, drift = _line(s)
        recorder["imu_bias"], recorder["imu_drift"] = rounded(begin), rounded(drift)
    if s.offset != base.offset:
        recorder["thrust_offset"] = rounded(s.offset)
    if s.fade != base.fade:
        recorder["thrust_fade"] = rounded(min(max(s.fade, -0.01), 0.01))
    if s.rotation != base.rotation:
        recorder["imu_rotation"] = rounded(list(s.rotation))
    for late, seconds in s.delays.items():
        if seconds != base.delays.get(late):
            recorder["late"], recorder["time_offset"] = late, rounded(seconds)


def _line(s: Settings) -> tuple[list[float], list[float]]:
    """Bias at the start and its drift, (3,) each: a straight line through what was found, the mean of all logs."""
    lines = []
    for file, seconds in enumerate(s.seconds):
        biases = s.biases(file)
        at = np.linspace(0, seconds, len(biases))
        drift, begin = np.polyfit(at, biases, 1) if len(biases) > 1 else (np.zeros(3), biases[0])
        lines.append((begin, drift))
    begin, drift = np.mean(lines, axis=0)
    return begin.tolist(), drift.tolist()


def _laws(vehicle: Vehicle, base: Settings, s: Settings) -> list[dict[str, Any]]:
    """Drag laws as in the file: those that are as before in their own words, then the others."""
    found: list[dict[str, Any]] = []
    laws = dict(s.laws)
    if s.inflow:  # at hover, and near it elsewhere
        laws["inflow"] = (LINEAR, (0.0, 0.0, s.inflow * vehicle.weight))
    for law in vehicle.drag_laws:
        slots = dict(_slots(law, vehicle))
        if slots and all(laws.get(slot) == base.laws.get(slot) for slot in slots):
            found.append(law.model_dump())
            for slot in slots:
                laws.pop(slot, None)
    vertical = 0.0
    if laws.get("vertical", (None,))[0] == LINEAR:
        vertical = laws.pop("vertical")[1][2]
    vertical += laws.pop("inflow", (LINEAR, (0.0, 0.0, 0.0)))[1][2]
    if "rotor" in laws and laws["rotor"][0] == LINEAR:
        x, y, _ = laws.pop("rotor")[1]
        found.insert(0, _dump(Linear, D=[_floor(x), _floor(y), _floor(vertical)]))
        vertical = 0.0
    for code, parameters in laws.values():
        found.append(_as_law(code, parameters, vehicle))
    if vertical > 0:
        found.append(_dump(Linear, D=[0.0, 0.0, _floor(vertical)]))
    return found


def _as_law(code: int, c: tuple[float, float, float], vehicle: Vehicle) -> dict[str, Any]:
    half = 0.5 * 1.225
    areas = [_floor(value / half) for value in c]
    if code == BODY_QUADRATIC:
        return _dump(BodyQuadratic, area=areas)
    if code == QUADRATIC:
        return _dump(AirsimQuadratic, area=areas, coefficient=1.0)
    if code == THRUST_DIFFERENCE:
        return _dump(ThrustDifference, c=rounded(c[0]))
    if code == ROTOR_SQRT:
        return _dump(RotorSqrt, c_d1=_floor(c[0]))
    raise AssertionError(f"no candidate changes the law {code}")


def _dump(law: type[AnyDragLaw], **keys: Any) -> dict[str, Any]:
    return law.model_validate(keys).model_dump()


def _floor(value: float) -> float:
    return max(rounded(value), 0.0)
