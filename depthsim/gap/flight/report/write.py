"""The report of a flight's diagnosis: diagnosis.json, vehicle.yaml and index.html."""

from pathlib import Path

from depthsim.gap.diagnosis import Diagnosis
from depthsim.gap.flight.effect import flight_effect
from depthsim.gap.flight.findings import Findings
from depthsim.gap.flight.report import words
from depthsim.gap.flight.report.drawing import FlightDrawing, measure_drawing
from depthsim.gap.flight.report.figures import axes_png, time_png
from depthsim.gap.report.drawing import write_drawing
from depthsim.gap.report.folder import report_folder
from depthsim.gap.report.page import Bar, Cell, Page, Tone
from depthsim.runs.storing import write_whole

VEHICLE, PAGE = "vehicle.yaml", "index.html"
_TONES: dict[str, Tone] = {"no_gap": "good", "explained": "good", "partly_explained": "fair", "unexplained": "bad"}


def write_report(folder: Path, found: Findings) -> None:
    """Write the report to ``folder``, whole or not at all; an earlier report there is replaced.

    Raises :class:`InputError` where ``folder`` is anything else than a report, and where the disk refuses.
    """
    drawing = measure_drawing(found)
    page = report_page(found.diagnosis, drawing)
    with report_folder(folder) as part:
        write_whole(part / VEHICLE, found.vehicle.to_yaml().encode())
        write_drawing(drawing, part)
        write_whole(part / PAGE, page.encode())
        found.diagnosis.write(part)


def report_page(diagnosis: Diagnosis, drawing: FlightDrawing) -> str:
    """index.html, from what diagnosis.json and drawing.json hold."""
    gap = diagnosis.gap
    page = Page(drawing.title, drawing.subtitle)
    page.callout(words.VERDICTS[diagnosis.verdict], _TONES[diagnosis.verdict])
    tiles = [(f"{gap.before:.3f} m/s²", "missed before"), (f"{gap.after:.3f} m/s²", "missed after")]
    tiles += [(f"{gap.floor:.3f} m/s²", "is noise"), (f"{gap.closed_fraction:.0%}", "of the gap closed")]
    page.tiles(tiles)
    _causes(page, diagnosis)
    _where(page, diagnosis, drawing)
    if diagnosis.unexplained is not None:
        page.section("What is left").text(diagnosis.unexplained.description)
        rows: list[list[Cell]] = [
            [cut.axis.replace("_", " "), words.place(cut), Bar(cut.share_of_gap), cut.what, words.learned(cut)]
            for cut in diagnosis.unexplained.where
        ]
        page.table(["axis", "most of it at", "share of it", "kind", "what can be learned"], rows)
        if diagnosis.unexplained.nearest:
            near: list[list[Cell]] = [
                [one.effect, Bar(one.closed_fraction), one.why_not] for one in diagnosis.unexplained.nearest
            ]
            page.text("Effects that come near, and are no causes:")
            page.table(["effect", "closes of the gap", "why it is none"], near)
    steps = words.next_steps(diagnosis)
    if steps:
        page.section("What to do next").items(steps)
    page.section("How it was measured").text(
        f"The gap is the {gap.measure}. Its floor is the noise that the residual's spectrum has above the motion. "
        "Every figure is from stretches of time that no parameter was fitted on; intervals are from resampling blocks "
        "of time."
    )
    page.items(diagnosis.notes)
    page.text("The vehicle with the causes added is in vehicle.yaml:")
    page.code("depthsim fly PATH --vehicle vehicle.yaml --out flight")
    return page.html()


def _causes(page: Page, diagnosis: Diagnosis) -> None:
    if not diagnosis.causes:
        return
    page.section("Causes, the one to act on first")
    rows: list[list[Cell]] = []
    for cause in diagnosis.causes:
        low, high = cause.ci95_closed
        others = ", ".join(cause.indistinguishable_from) or "-"
        share = Bar(cause.closed_fraction, f"{cause.closed_fraction:.0%} ({low:.0%} to {high:.0%})")
        title = f"{cause.effect}: {flight_effect(cause.effect).title}"
        rows.append([title, share, f"{cause.parameters['formula']}: {words.parameters(cause)}", others])
    page.table(["cause", "closes of the gap", "fitted (95 %)", "indistinguishable from"], rows)


def _where(page: Page, diagnosis: Diagnosis, drawing: FlightDrawing) -> None:
    page.section("Where the forces differ")
    if diagnosis.where:
        rows: list[list[Cell]] = [
            [cut.axis.replace("_", " "), words.place(cut), Bar(cut.share_of_gap), cut.what, words.learned(cut)]
            for cut in diagnosis.where
        ]
        page.table(["axis", "most of it at", "share of the gap", "kind", "what can be learned"], rows)
    page.picture(
        axes_png(drawing.axes, diagnosis.gap.floor),
        "What the model misses along each axis, before and after the causes were added, beside the noise. Each point "
        "is an eighth of the samples.",
    )
    page.picture(time_png(drawing), "The same over time along each axis of the body, 4 Hz low-pass, first log.")
