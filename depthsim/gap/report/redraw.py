"""The page of a report, drawn again from diagnosis.json and drawing.json without simulating again."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from depthsim.errors import InputError
from depthsim.gap.depth.report.compare import ComparisonDrawing, comparison_page
from depthsim.gap.depth.report.drawing import DepthDrawing
from depthsim.gap.depth.report.page import report_page
from depthsim.gap.diagnosis import Diagnosis
from depthsim.gap.flight.report.drawing import FlightDrawing
from depthsim.gap.flight.report.write import report_page as flight_page
from depthsim.gap.report.drawing import DRAWING, read_drawing
from depthsim.runs.storing import write_whole

PAGE = "index.html"
_DRAWINGS: TypeAdapter[Any] = TypeAdapter(
    Annotated[DepthDrawing | ComparisonDrawing | FlightDrawing, Field(discriminator="kind")]
)


def redraw(folder: Path) -> Path:
    """Write index.html of a report again. Raises :class:`InputError` where the folder is none, or is damaged."""
    diagnosis, text = Diagnosis.read(folder), read_drawing(folder)
    try:
        drawing = _DRAWINGS.validate_json(text)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(map(str, first["loc"]))
        raise InputError(folder / DRAWING, place, str(first["msg"]), "run diagnose again") from None
    if isinstance(drawing, DepthDrawing):
        page = report_page(diagnosis, drawing)
    elif isinstance(drawing, ComparisonDrawing):
        page = comparison_page(diagnosis, drawing)
    else:
        page = flight_page(diagnosis, drawing)
    write_whole(folder / PAGE, page.encode())
    return folder / PAGE
