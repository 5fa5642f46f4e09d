"""The page of a diagnosis, for people."""

from pathlib import Path

from depthsim.gap.depth.report.drawing import DepthDrawing
from depthsim.gap.depth.report.figures import pictures
from depthsim.gap.depth.tasks.figures import FIGURES, ODOMETRY
from depthsim.gap.depth.where.residual import stub
from depthsim.gap.diagnosis import Cause, Cut, Diagnosis
from depthsim.gap.report import words
from depthsim.gap.report.figures import Picture
from depthsim.gap.report.page import Bar, Page

_MEASURE = (
    "Errors of recording and simulation are counted in histograms, in every part of every axis: range, angle, "
    "material, place in the image and on the scene, distance to depth edges, time, motion, neighbouring pixels and "
    "frames. The gap is how much one look at a pixel says, on average, of which of the two it is from "
    "(Jensen-Shannon divergence: 0 bits if they are alike, 1 if they never overlap)."
)


def report_page(d: Diagnosis, drawing: DepthDrawing, drawn: dict[str, Picture] | None = None) -> str:
    """index.html, from what diagnosis.json and drawing.json hold. drawn: the pictures, where they are drawn already."""
    drawn = pictures(drawing) if drawn is None else drawn
    page = Page(f"Depth diagnosis of {Path(drawing.origin.run).absolute().name}", drawing.subtitle)
    page.tiles(_tiles(d))
    _answer(page, d)
    _where(page, d, drawn)
    if d.causes or "candidates" in drawn:
        _which(page, d, drawn)
    if d.unexplained is not None:
        _rest(page, d)
    if d.tasks:
        _costs(page, d)
    page.section("What to do next")
    for step in words.next_steps(d, drawing.origin):
        page.text(step.text)
        if step.command:
            page.code(step.command)
    return page.html()


def _tiles(d: Diagnosis) -> list[tuple[str, str]]:
    titles = {
        "no_gap": "No gap",
        "explained": "Explained",
        "partly_explained": "Partly explained",
        "unexplained": "Unexplained",
    }
    tiles = [(titles[d.verdict], "the verdict"), (f"{d.gap.before:.3g}", f"the gap, {d.gap.unit}")]
    if d.causes:
        tiles.append((f"{d.gap.after:.3g}", "with the causes added"))
    tiles.append((f"{d.gap.floor:.3g}", "the floor: two runs of one sensor"))
    if d.causes:
        tiles.append((words.percent(d.gap.closed_fraction), "of the gap closed, on held-out frames"))
    return tiles


def _answer(page: Page, d: Diagnosis) -> None:
    page.section("The answer").callout(words.verdict(d), words.tone(d))
    page.items(
        f"{cause.effect}: {words.about(cause.effect)}. Closes {_closes(cause)} of the gap." for cause in d.causes
    )
    page.items(words.sentence(note) for note in d.notes)
    page.text(_MEASURE)


def _where(page: Page, d: Diagnosis, drawn: dict[str, Picture]) -> None:
    if not (d.where or drawn):
        return
    page.section("Where the gap lies")
    if d.where:
        page.text(
            "Each axis is judged by how much of the gap a correction learned along it closes on frames held out; the "
            "part named is the one that holds most of it. Shares of different axes overlap and do not add up."
        )
        _cuts(page, d.where)
    for name in ("curves", "correlation", "errors", "image", "mesh"):
        if name in drawn:
            page.picture(drawn[name].png, drawn[name].caption)


def _which(page: Page, d: Diagnosis, drawn: dict[str, Picture]) -> None:
    page.section("Which effects cause it")
    for cause in d.causes:
        _cause(page, cause)
    if "candidates" in drawn:
        page.picture(drawn["candidates"].png, drawn["candidates"].caption)


def _cause(page: Page, cause: Cause) -> None:
    rows = [
        [p.name, p.value, "held" if p.low is None else f"{p.low} to {p.high}", p.unit, p.about]
        for p in words.parameters(cause)
    ]
    page.text(f"{cause.effect} closes {_closes(cause)} of the gap.")
    if rows:
        page.table(["parameter", "value", "95 % interval", "unit", "what it is"], rows, numbers=(1, 2))
    if cause.indistinguishable_from:
        page.callout(" ".join(filter(None, (words.tie(cause), words.sentence(cause.advice)))), "fair")


def _closes(cause: Cause) -> str:
    return words.closed_text(cause.closed_fraction, cause.ci95_closed)


def _rest(page: Page, d: Diagnosis) -> None:
    left = d.unexplained
    assert left is not None
    page.section("What stays unexplained")
    page.callout(f"{words.percent(left.fraction)} of the gap: {words.sentence(left.description)}", "fair")
    if left.where and left.where != d.where:
        _cuts(page, left.where)
    if left.nearest:
        page.text("These come near and are no causes:")
        page.table(["effect", "closes", "why it is none"], [words.near(n) for n in left.nearest], numbers=(1,))
    if words.lacks_an_effect(d):
        page.text(f"The beginning of a new effect, also written to {words.STUB}:").code(stub(left.where[0]))


def _costs(page: Page, d: Diagnosis) -> None:
    causes = bool(d.causes)
    page.section("What the gap costs")
    page.text(
        "What the software of a robot sees, on frames that nothing was fitted to: the same figures of the recording "
        "and of its simulation, on the same pixels."
    )
    rows = [[*words.task_row(task, causes=causes), _about(task.name)] for task in d.tasks]
    page.table([*words.task_head(causes=causes), "what it is"], rows, numbers=range(1, 4 if causes else 3))
    page.items(words.sentence(note) for note in words.task_notes(d.tasks))


def _about(task: str) -> str:
    known = FIGURES | ODOMETRY
    return known[task].about if task in known else ""  # another version's report may be drawn again


def _cuts(page: Page, cuts: tuple[Cut, ...]) -> None:
    page.table(
        ["where", "share of the gap", "kind", "what differs"],
        [[words.place(cut), Bar(cut.share_of_gap), cut.what, cut.text] for cut in cuts],
    )
