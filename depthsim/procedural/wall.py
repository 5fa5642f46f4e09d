"""The wall of the paper's measurement."""

from depthsim.procedural.part import Part
from depthsim.procedural.primitives import box


def wall(material: str = "cement", width: float = 20.0, height: float = 20.0) -> Part:
    """A flat wall square to the x axis, as in section 2 of the paper.

    Its front is the plane x = 0 and looks along -x, its foot is at z = 0, and y = 0 runs through its middle. A
    camera on the rail y = 0, z = height / 2 sees nothing else up to 8 m away with 90 degrees of view.
    """
    for name, value in (("width", width), ("height", height)):
        if not 0.01 <= value <= 1000:
            raise ValueError(f"wall: {name} is {value} m; give 0.01 to 1000")
    return box((0.2, width, height), material, (0.1, 0.0, height / 2))
