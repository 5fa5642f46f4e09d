"""Things that move: a person, the leaf of a door, a small quadrotor."""

from depthsim.procedural.part import Part, join
from depthsim.procedural.primitives import box, cushion, cylinder, sphere
from depthsim.procedural.race import drone as _drone
from depthsim.procedural.walls import lever

HIP, SHOULDER = 0.92, 1.42
"""[m] The heights that legs and arms swing about."""
_PARTS = ("body", "leg", "arm")


def person(part: str = "body") -> Part:
    """A person of 1.75 m, facing +x: the body, which stands on z = 0, or a leg or arm, which hangs from the origin."""
    if part == "leg":
        thigh = cushion((0.17, 0.15, 0.5), "fabric", segments=16, rings=10).moved(z=-0.23)
        shin = cushion((0.13, 0.12, 0.48), "fabric", segments=16, rings=10).moved(z=-0.62)
        return join([thigh, shin, cushion((0.27, 0.1, 0.09), "rubber", segments=16, rings=8).moved(0.05, 0, -0.87)])
    if part == "arm":
        upper = cushion((0.11, 0.1, 0.34), "fabric", segments=14, rings=8).moved(z=-0.14)
        lower = cushion((0.09, 0.08, 0.32), "fabric", segments=14, rings=8).moved(0.02, 0, -0.42)
        return join([upper, lower, sphere(0.05, "rubber", 12, 8).moved(0.03, 0, -0.6)])
    if part != "body":
        raise ValueError(f"person: part is {part!r}; give one of {', '.join(_PARTS)}")
    return join(
        [
            cushion((0.24, 0.4, 0.6), "fabric", segments=28, rings=16).moved(z=1.2),
            cushion((0.23, 0.34, 0.26), "fabric", segments=24, rings=12).moved(z=0.95),
            cylinder(0.055, 0.14, "rubber", 16).moved(z=1.45),
            sphere(0.11, "rubber", 24, 16).scaled(1.0, 0.85, 1.15).moved(0.01, 0, 1.62),
            sphere(0.114, "fabric", 24, 12).scaled(0.95, 0.87, 0.8).moved(-0.01, 0, 1.665),
        ]
    )


def door_leaf(width: float = 0.9, height: float = 2.05) -> Part:
    """The leaf of a door, hinged at the origin and closed along +x; its lever is on the side of +y."""
    if width < 0.3 or height < 0.6:
        raise ValueError(f"door_leaf: {width} by {height} m; give at least 0.3 by 0.6")
    leaf = box((width - 0.01, 0.04, height - 0.01), "wood", (width / 2, -0.02, height / 2))
    plate = box((width - 0.06, 0.002, 0.18), "metal", (width / 2, 0.001, 0.11))
    return join([leaf, plate, lever().turned(yaw=180).moved(width - 0.07, 0, 1.05)])


def drone() -> Part:
    """A small quadrotor, 36 cm across, about the origin; its camera looks along +x."""
    return _drone().moved(z=-0.066)
