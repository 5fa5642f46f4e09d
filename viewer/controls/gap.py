"""A report on the page: its verdict, its causes as switches, the gap that is left, and where it lies."""

from collections.abc import Callable

import viser

from depthsim.gap.diagnosis import Cause, Cut, Diagnosis
from depthsim.gap.report import words
from viewer.controls.handles import put
from viewer.report import Report

_VERDICTS = {
    "no_gap": "no gap",
    "explained": "explained",
    "partly_explained": "partly explained",
    "unexplained": "unexplained",
}


class GapControls:
    """The causes that are switched on are added to the live sensor."""

    def __init__(self, gui: viser.GuiApi, report: Report, changed: Callable[[], None]) -> None:
        self._report, self._filling = report, False
        gap = report.diagnosis.gap
        gui.add_markdown(f"**{_VERDICTS[report.diagnosis.verdict].capitalize()}.** {gap.measure} [{gap.unit}]")
        self._number = gui.add_markdown("")
        self._bar = gui.add_progress_bar(0.0, color="orange")
        self._switches = []
        gui.add_markdown("**Causes**, added to the sensor" if report.causes else "No cause was found.")
        for cause in report.diagnosis.causes:
            switch = gui.add_checkbox(f"{cause.effect}  ({cause.closed_fraction:.0%})", False, hint=_about(cause))
            switch.on_update(lambda _: None if self._filling else self._moved(changed))
            self._switches.append(switch)
        if self._switches:
            group = gui.add_button_group("causes", ["add all", "remove all"])
            group.on_click(lambda event: self._all(event.target.value == "add all", changed))
        rest = report.diagnosis.unexplained
        if report.diagnosis.where:
            gui.add_markdown("**Where the gap lies**\n\n" + _table(report.diagnosis.where))
        if rest is not None:
            gui.add_markdown(f"**Unexplained: {rest.fraction:.0%}.** {rest.description}\n\n" + _table(rest.where))
        if report.diagnosis.tasks:
            gui.add_markdown("**What it costs**\n\n" + _costs(report.diagnosis))
        for note in report.diagnosis.notes:
            gui.add_markdown(f"*{note}*")
        self._show()

    def chosen(self) -> set[int]:
        """The numbers of the causes that are switched on."""
        return {number for number, switch in enumerate(self._switches) if switch.value}

    def gap(self) -> float:
        """The gap that is left."""
        return self._report.gap(self.chosen())

    def _moved(self, changed: Callable[[], None]) -> None:
        self._show()
        changed()

    def _all(self, on: bool, changed: Callable[[], None]) -> None:
        self._filling = True
        for switch in self._switches:
            put(switch, on)
        self._filling = False
        self._moved(changed)

    def _show(self) -> None:
        gap, left = self._report.diagnosis.gap, self.gap()
        self._number.content = (
            f"## Gap {left:.3g} {gap.unit}\nbefore {gap.before:.3g}, two runs of one sensor {gap.floor:.3g}"
        )
        span = gap.before - gap.floor
        put(self._bar, float(min(max(100 * (left - gap.floor) / span if span > 0 else 0, 0), 100)))


def _about(cause: Cause) -> str:
    values = ", ".join(f"{name} {value:.4g}" if isinstance(value, float) else f"{name} {value}"
                       for name, value in cause.parameters.items())  # fmt: skip
    low, high = cause.ci95_closed
    parts = [values, f"closes {cause.closed_fraction:.0%} of the gap (95 %: {low:.0%} to {high:.0%})"]
    if cause.indistinguishable_from:
        parts.append(f"with these data it is indistinguishable from {', '.join(cause.indistinguishable_from)}")
    return "; ".join(filter(None, [*parts, cause.advice]))


def _table(cuts: tuple[Cut, ...]) -> str:
    """The first cuts as a table in Markdown."""
    lines = ["| share | where | what |", "| ---: | --- | --- |"]
    for cut in cuts[:8]:
        lines.append(f"| {cut.share_of_gap:.0%} | {words.place(cut)} | {cut.what} |")
    return "\n".join(lines) if cuts else ""


def _costs(diagnosis: Diagnosis) -> str:
    """What a robot's software sees, as a table in Markdown: of the recording, before, and with the causes."""
    causes = bool(diagnosis.causes)
    rows = [words.task_head(causes=causes), *(words.task_row(task, causes=causes) for task in diagnosis.tasks)]
    lines = ["| " + " | ".join(cell.replace("*", "\\*") for cell in row) + " |" for row in rows]
    notes = [words.sentence(note).replace("*", "\\*") for note in words.task_notes(diagnosis.tasks)]
    return "\n".join([lines[0], "| --- |" + " ---: |" * (len(rows[0]) - 1), *lines[1:], "", *notes])
