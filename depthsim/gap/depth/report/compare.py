"""What is reported of two recordings that were compared: the page for the terminal, and the folder."""

from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.text import Text

from depthsim.gap.depth.compare import Comparison
from depthsim.gap.depth.report.curves import AxisCurves, Series, axis_curves, best_axes
from depthsim.gap.depth.report.figures_curves import curves_picture
from depthsim.gap.diagnosis import Diagnosis
from depthsim.gap.report import words
from depthsim.gap.report.drawing import Drawn, write_drawing
from depthsim.gap.report.figures import FIXED, REAL
from depthsim.gap.report.folder import report_folder
from depthsim.gap.report.page import Bar, Page
from depthsim.gap.report.terminal import command, cuts, figures, head, say
from depthsim.runs.storing import write_whole

_ROWS = 3


class ComparisonDrawing(Drawn):
    """What the page of a comparison draws beside diagnosis.json. a, b: the names of the recordings."""

    kind: Literal["comparison"] = "comparison"
    a: str
    b: str
    curves: tuple[AxisCurves, ...]


def write_comparison(compared: Comparison, folder: Path) -> None:
    """Write the report to ``folder``, whole or not at all; an earlier report there is replaced."""
    drawing = _measure(compared)
    page = comparison_page(compared.diagnosis, drawing)
    with report_folder(folder) as part:
        write_drawing(drawing, part)
        write_whole(part / "index.html", page.encode())
        compared.diagnosis.write(part)


def show_comparison(console: Console, compared: Comparison, folder: Path) -> None:
    """Print the page for the terminal."""
    d = compared.diagnosis
    console.print(Text(_verdict(d), style="bold green" if d.verdict == "no_gap" else "bold yellow"))
    head(console, "The gap")
    figures(console, _lines(d))
    if d.where:
        head(console, "Where")
        cuts(console, d.where)
    head(console, "Notes")
    for note in d.notes:
        say(console, words.sentence(note))
    head(console, "Next")
    say(console, "For causes, diagnose each against a profile:")
    for run in (compared.a.run.path, compared.b.run.path):
        command(console, words.command("diagnose", str(run), "--out", f"{folder}_{run.name}"))
    say(console, "The report, with pictures:")
    command(console, f"{folder}/index.html")


def _verdict(d: Diagnosis) -> str:
    if d.verdict == "no_gap":
        return "No difference: the two recordings are as alike as two halves of them."
    what = d.unexplained.description if d.unexplained else ""
    return f"The two differ: {what}."


def _lines(d: Diagnosis) -> list[tuple[str, str]]:
    return [
        (f"{words.figure(d.gap.before)} {d.gap.unit}", "between A and B"),
        (f"{words.figure(d.gap.floor)} {d.gap.unit}", "the floor: halves that have as much of each"),
    ]


def _measure(compared: Comparison) -> ComparisonDrawing:
    a, b = compared.a, compared.b
    ranked = [n for cut in compared.diagnosis.where for n, axis in enumerate(a.axes) if axis.name == cut.axis]
    series: list[Series] = [("A", REAL, compared.counts_a), ("B", FIXED, compared.counts_b)]
    curves = tuple(axis_curves(a, number, series) for number in best_axes(a, ranked, _ROWS))
    return ComparisonDrawing(a=a.run.path.absolute().name, b=b.run.path.absolute().name, curves=curves)


def comparison_page(d: Diagnosis, drawing: ComparisonDrawing) -> str:
    """index.html, from what diagnosis.json and drawing.json hold."""
    page = Page(f"{drawing.a} (A) and {drawing.b} (B)", "two recordings of one scene")
    page.tiles([(f"{line.split()[0]}", f"{d.gap.unit}, {what}") for line, what in _lines(d)])
    page.section("The answer").callout(_verdict(d), "good" if d.verdict == "no_gap" else "fair")
    page.items(words.sentence(note) for note in d.notes)
    page.section("Where they differ")
    page.text(
        "Errors of both are in one unit, the spread that the paper's sensor would have at the same range and "
        "material, and pixels are weighted by what both runs have seen."
    )
    if d.where:
        page.table(
            ["axis and part", "share of the axis' difference", "kind", "what differs"],
            [[words.place(cut), Bar(cut.share_of_gap), cut.what, cut.text] for cut in d.where],
        )
    if drawing.curves:
        picture = curves_picture(drawing.curves)
        page.picture(picture.png, picture.caption)
    return page.html()
