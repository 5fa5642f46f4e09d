"""All pictures of a diagnosis of depth."""

from depthsim.gap.depth.report.drawing import DepthDrawing
from depthsim.gap.depth.report.figures_candidates import candidates_picture
from depthsim.gap.depth.report.figures_curves import curves_picture
from depthsim.gap.depth.report.figures_errors import correlation_picture, errors_picture
from depthsim.gap.depth.report.figures_where import image_picture, mesh_picture
from depthsim.gap.report.figures import Picture


def pictures(drawing: DepthDrawing) -> dict[str, Picture]:
    """By name: those for which there is something to draw."""
    drawn = {"errors": errors_picture(drawing.errors)}
    if drawing.curves:
        drawn["curves"] = curves_picture(drawing.curves)
    if drawing.correlations:
        drawn["correlation"] = correlation_picture(drawing.correlations)
    if drawing.image is not None:
        drawn["image"] = image_picture(drawing.image)
    if drawing.mesh is not None:
        drawn["mesh"] = mesh_picture(drawing.mesh)
    if drawing.candidates:
        drawn["candidates"] = candidates_picture(drawing.candidates)
    return drawn
