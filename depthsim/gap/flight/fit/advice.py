"""What to record next: which flight would tell apart effects that these logs cannot."""

from collections.abc import Sequence

_PAIRS = {
    frozenset(
        ("thrust_scale", "mass")
    ): "Weigh the vehicle, or fly fast as well: mass divides the drag, a thrust scale does not.",
    frozenset(("rotor_drag", "body_drag_quadratic")): "Fly the same path at two speeds or more: one force grows with "
    "the speed, the other with its square.",
    frozenset(("imu_bias", "imu_misalignment")): "Climb and brake hard, so that the thrust changes: a turned sensor's "
    "error goes with it, a bias does not.",
    frozenset(("imu_bias", "constant_wind")): "Turn on the spot: the wind's force turns against the body, a bias does "
    "not.",
    frozenset(("imu_misalignment", "constant_wind")): "Turn on the spot: the wind's force turns against the body, a "
    "sensor's error does not.",
    frozenset(("thrust_lag", "log_time_offset")): "Step the thrust sharply, as in hops: a lag rounds the edges, an "
    "offset only moves them.",
    frozenset(("vertical_damping", "body_drag_quadratic")): "Climb and sink at two rates or more.",
    frozenset(("ground_effect", "thrust_scale")): "Fly at several heights, the lowest within two rotor radii.",
    frozenset(("ground_effect", "mass")): "Fly at several heights, the lowest within two rotor radii.",
    frozenset(("rotor_thrust_difference", "thrust_scale")): "Log each rotor's thrust in fast turns about all axes.",
    frozenset(("rotor_thrust_difference", "mass")): "Weigh the vehicle, and log each rotor's thrust.",
    frozenset(("imu_bias", "thrust_scale")): "Fly hops: a scale grows with the thrust, a bias does not.",
    frozenset(("imu_bias", "mass")): "Weigh the vehicle, or fly hops: a wrong mass grows with the thrust.",
}
_ALONE = {
    "gusting_wind": "Fly again in still air: what is left then is not the wind.",
    "constant_wind": "Fly again in still air, or give the wind that was measured.",
    "mass": "Weigh the vehicle.",
}


def advice(effect: str, others: Sequence[str]) -> str:
    """One or two sentences; empty where there is nothing to add."""
    found = [_PAIRS.get(frozenset((effect, other)), "") for other in others]
    told = list(dict.fromkeys(sentence for sentence in found if sentence))
    if others and not told:
        told = ["Fly at other speeds, heights and headings, with climbs and hard turns."]
    return " ".join(told) if others else _ALONE.get(effect, "")
