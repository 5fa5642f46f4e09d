"""A diagnosis as it shows itself in a notebook and in a Python shell. The same for a depth sensor and for a flight."""

import re
from collections.abc import Iterable, Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from depthsim.gap.report import words

if TYPE_CHECKING:
    from depthsim.gap.diagnosis import Cause, Cut, Diagnosis

_COLOURS = {"good": "#1a7f4b", "fair": "#b06a00", "bad": "#b3261e"}
_PICTURES, _CUTS = 2, 3
_FIGURE = re.compile(
    r'<figure[^<>]*><img alt="[^"]*" src="data:image/png;base64,[A-Za-z0-9+/=]*">'
    r"(?:<figcaption>[^<]*</figcaption>)?</figure>"
)
"""A picture of a report's page, which is drawn by depthsim.gap.report.page."""


def text(diagnosis: "Diagnosis") -> str:
    """The verdict, the gap, a line for each cause, and where most of the gap lies."""
    lines = [words.verdict(diagnosis)]
    lines += [f"  {figure}: {what}" for figure, what in words.gap_lines(diagnosis.gap, causes=bool(diagnosis.causes))]
    for cause in diagnosis.causes:
        lines.append(f"{cause.effect} closes {words.closed_text(cause.closed_fraction, cause.ci95_closed)} of the gap")
        lines += [f"  {one.text}" for one in words.parameters(cause)]
        if cause.indistinguishable_from:
            lines.append(f"  {words.tie(cause)}")
    lines += [
        f"{words.percent(cut.share_of_gap)} of it at {words.place(cut)}: {_kind(cut)}"
        for cut in diagnosis.where[:_CUTS]
    ]
    if diagnosis.unexplained is not None:
        lines.append(words.sentence(diagnosis.unexplained.description))
    return "\n".join(lines)


def html(diagnosis: "Diagnosis", report: Path | None) -> str:
    """The same with the first pictures of the report, the curves, where there is a report."""
    colour = _COLOURS[words.tone(diagnosis)]
    parts = [f'<p style="color:{colour}"><b>{escape(words.verdict(diagnosis))}</b></p>']
    parts.append(_table("", words.gap_lines(diagnosis.gap, causes=bool(diagnosis.causes))))
    if diagnosis.causes:
        parts.append(_table("Causes", map(_cause, diagnosis.causes)))
    if diagnosis.where:
        rows = ((words.percent(cut.share_of_gap), words.place(cut), _kind(cut)) for cut in diagnosis.where[:_CUTS])
        parts.append(_table("Where", rows))
    if diagnosis.unexplained is not None:
        parts.append(f"<p>{escape(words.sentence(diagnosis.unexplained.description))}</p>")
    parts += pictures(report) if report is not None else []
    return f"<div>{''.join(parts)}</div>"


def pictures(report: Path) -> list[str]:
    """The first pictures of a report's page, as HTML; none where there is no page."""
    try:
        page = (report / "index.html").read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        return []
    return [found.group() for found in list(_FIGURE.finditer(page))[:_PICTURES]]


def _cause(cause: "Cause") -> tuple[str, str, str, str]:
    fitted = "; ".join(one.text for one in words.parameters(cause))
    return cause.effect, words.closed_text(cause.closed_fraction, cause.ci95_closed), fitted, words.tie(cause)


def _kind(cut: "Cut") -> str:
    return cut.text or cut.what


def _table(title: str, rows: Iterable[Sequence[str]]) -> str:
    head = f"<caption style='text-align:left'><b>{escape(title)}</b></caption>" if title else ""
    lines = ("".join(f"<td style='text-align:left'>{escape(cell)}</td>" for cell in row) for row in rows)
    return f"<table>{head}{''.join(f'<tr>{line}</tr>' for line in lines)}</table>"
