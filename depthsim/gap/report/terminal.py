"""A diagnosis as a page for the terminal. Commands are never broken, so that they can be copied."""

from rich.console import Console
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from depthsim.gap.diagnosis import Cause, Cut, Diagnosis
from depthsim.gap.report import words
from depthsim.gap.report.words import Origin

_COLOURS = {"good": "green", "fair": "yellow", "bad": "red"}
_BAR = 10


def show(console: Console, diagnosis: Diagnosis, origin: Origin) -> None:
    """Print the page."""
    tone = _COLOURS[words.tone(diagnosis)]
    console.print(Text(words.verdict(diagnosis), style=f"bold {tone}"))
    head(console, "The gap")
    figures(console, words.gap_lines(diagnosis.gap, causes=bool(diagnosis.causes)))
    if diagnosis.where:
        head(console, "Where")
        cuts(console, diagnosis.where)
    if diagnosis.causes:
        head(console, "Causes")
        for cause in diagnosis.causes:
            _cause(console, cause)
    left = diagnosis.unexplained
    if left is not None:
        head(console, f"Unexplained: {words.percent(left.fraction)} of the gap")
        say(console, words.sentence(left.description))
        if left.where != diagnosis.where:
            cuts(console, left.where)
        for near in left.nearest[1:]:  # the first is in the sentence
            effect, closes, why = words.near(near)
            say(console, f"{effect} closes {closes}; it is no cause, as it {why}.")
    if diagnosis.tasks:
        head(console, "What it costs")
        _tasks(console, diagnosis)
    if diagnosis.notes:
        head(console, "Notes")
        for note in diagnosis.notes:
            say(console, words.sentence(note))
    head(console, "Next")
    for step in words.next_steps(diagnosis, origin):
        say(console, step.text)
        if step.command:
            command(console, step.command)
    say(console, "The report, with pictures:")
    command(console, f"{origin.report}/index.html")


def head(console: Console, title: str) -> None:
    """A heading."""
    console.print()
    console.print(Text(title, style="bold"))


def say(console: Console, text: str, indent: int = 2, style: str = "") -> None:
    """A paragraph."""
    console.print(Padding(Text(text, style=style), (0, 0, 0, indent), expand=False))


def command(console: Console, line: str) -> None:
    """A line to be copied."""
    console.print(Text(f"    {line}", style="cyan"), soft_wrap=True)


def figures(console: Console, lines: list[tuple[str, str]]) -> None:
    """Figures, and what each is."""
    table = _table()
    for figure, what in lines:
        table.add_row(Text(figure), Text(what, style="dim"))
    console.print(table)


def cuts(console: Console, where: tuple[Cut, ...]) -> None:
    """Where the gap lies, a line each."""
    table = _table()
    for cut in where:
        share = min(max(cut.share_of_gap, 0.0), 1.0)
        bar = "#" * round(_BAR * share)
        row = [Text(f"{100 * share:3.0f} %"), Text(words.place(cut)), Text(cut.text, style="dim")]
        if console.width >= 76:
            row.insert(1, Text(bar.ljust(_BAR, "."), style="blue"))
        table.add_row(*row)
    console.print(table)


def _cause(console: Console, cause: Cause) -> None:
    console.print(Padding(Text(cause.effect, style="bold"), (0, 0, 0, 2), expand=False))
    what = words.about(cause.effect)
    if what:
        say(console, words.sentence(what), 4, "dim")
    say(console, f"closes {words.closed_text(cause.closed_fraction, cause.ci95_closed)} of the gap", 4)
    for parameter in words.parameters(cause):
        held = ", held" if cause.ci95 and parameter.low is None else ""
        say(console, parameter.text + held, 4)
    if cause.indistinguishable_from:
        say(console, words.tie(cause), 4, "yellow")
        say(console, words.sentence(cause.advice), 4, "yellow")


def _tasks(console: Console, diagnosis: Diagnosis) -> None:
    causes, table = bool(diagnosis.causes), _table()
    table.add_row(*(Text(cell, style="dim") for cell in words.task_head(causes=causes)))
    for task in diagnosis.tasks:
        table.add_row(*map(Text, words.task_row(task, causes=causes)))
    console.print(table)
    for note in words.task_notes(diagnosis.tasks):
        say(console, words.sentence(note), style="dim")


def _table() -> Table:
    return Table(box=None, show_header=False, padding=(0, 2, 0, 0), pad_edge=False, expand=False)
