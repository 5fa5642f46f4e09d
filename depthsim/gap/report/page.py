"""A self-contained HTML page for people: words, figures, pictures and tables; nothing is loaded from outside.

    page = Page("Diagnosis of run", "one line under it")
    page.tiles([("82 %", "of the gap is closed"), ("0.04 m/s²", "is left")])
    page.section("Where the gap lies").text("...").picture(png, "caption").table(["axis", "share"], [["speed", "40 %"]])
    page.html()

All texts are plain: they are escaped here. A cell of a table may be a :class:`Bar`, which is drawn.
"""

import base64
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from typing import Literal

Tone = Literal["plain", "good", "fair", "bad"]


@dataclass(frozen=True)
class Bar:
    """A share of 0 to 1, drawn as a bar with its ``label`` beside it; by itself the label is the percentage."""

    share: float
    label: str | None = None


Cell = str | Bar


class Page:
    """A page under construction. Every method gives the page back, so that calls can be chained."""

    def __init__(self, title: str, subtitle: str = "") -> None:
        self._title = title
        self._parts = [f"<header><h1>{escape(title)}</h1>"]
        if subtitle:
            self._parts.append(f'<p class="subtitle">{escape(subtitle)}</p>')
        self._parts.append("</header>")
        self._open = False

    def section(self, title: str) -> "Page":
        """Begin a section."""
        self._close()
        self._parts.append(f"<section><h2>{escape(title)}</h2>")
        self._open = True
        return self

    def text(self, *paragraphs: str) -> "Page":
        """Paragraphs."""
        self._parts.extend(f"<p>{escape(paragraph)}</p>" for paragraph in paragraphs)
        return self

    def callout(self, text: str, tone: Tone = "plain") -> "Page":
        """A paragraph in a coloured frame: what the reader must not miss."""
        self._parts.append(f'<p class="callout {tone}">{escape(text)}</p>')
        return self

    def items(self, items: Iterable[str]) -> "Page":
        """A bulleted list; nothing where there are no items."""
        lines = "".join(f"<li>{escape(item)}</li>" for item in items)
        if lines:
            self._parts.append(f"<ul>{lines}</ul>")
        return self

    def tiles(self, tiles: Iterable[tuple[str, str]]) -> "Page":
        """A row of large figures, each with the words that go under it."""
        inner = "".join(
            f'<div class="tile"><b>{escape(figure)}</b><span>{escape(words)}</span></div>' for figure, words in tiles
        )
        self._parts.append(f'<div class="tiles">{inner}</div>')
        return self

    def picture(self, png: bytes, caption: str = "", *, width: int | None = None) -> "Page":
        """A PNG, put into the page. width: the greatest [px]; as wide as the text by default."""
        style = f' style="max-width:{width}px"' if width else ""
        data = base64.b64encode(png).decode()
        words = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
        alt = escape(caption or self._title, quote=True)
        self._parts.append(f'<figure{style}><img alt="{alt}" src="data:image/png;base64,{data}">{words}</figure>')
        return self

    def table(self, head: Sequence[str], rows: Iterable[Sequence[Cell]], *, numbers: Iterable[int] = ()) -> "Page":
        """A table. numbers: the columns, from 0, that hold figures and are set flush right."""
        right = set(numbers)

        def cells(row: Sequence[Cell], tag: str) -> str:
            return "".join(
                f"<{tag}{' class=n' if index in right else ''}>{_cell(cell)}</{tag}>" for index, cell in enumerate(row)
            )

        body = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in rows)
        self._parts.append(
            f'<div class="wide"><table><thead><tr>{cells(head, "th")}</tr></thead><tbody>{body}</tbody></table></div>'
        )
        return self

    def code(self, text: str) -> "Page":
        """A command or a file, set as it is."""
        self._parts.append(f"<pre>{escape(text)}</pre>")
        return self

    def html(self) -> str:
        """The whole page."""
        self._close()
        title, parts = escape(self._title), "\n".join(self._parts)
        return (
            '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{title}</title>\n<style>{_STYLE}</style></head>\n<body><main>\n{parts}\n</main></body></html>\n"
        )

    def _close(self) -> None:
        if self._open:
            self._parts.append("</section>")
            self._open = False


def _cell(cell: Cell) -> str:
    if isinstance(cell, str):
        return escape(cell)
    share = min(max(cell.share, 0.0), 1.0)
    label = f"{share:.0%}" if cell.label is None else cell.label
    return f'<span class="bar"><i><em style="width:{100 * share:.1f}%"></em></i><span>{escape(label)}</span></span>'


_STYLE = """
:root{--ink:#1d2733;--soft:#5b6875;--line:#dfe4ea;--ground:#f4f6f8;--accent:#1f6feb;
--good:#1a7f4b;--fair:#b06a00;--bad:#b3261e}
*{box-sizing:border-box}
body{margin:0;background:var(--ground);color:var(--ink);font:16px/1.55 system-ui,-apple-system,"Segoe UI",Roboto,
"Helvetica Neue",Arial,sans-serif}
main{max-width:980px;margin:0 auto;padding:32px 20px 56px}
header{margin-bottom:20px}
h1{font-size:28px;line-height:1.2;margin:0 0 4px}
h2{font-size:19px;margin:0 0 10px}
.subtitle{color:var(--soft);margin:0}
section{background:#fff;border:1px solid var(--line);border-radius:10px;padding:20px 24px;margin:0 0 18px}
p{margin:0 0 10px;max-width:78ch}
ul{margin:0 0 10px;padding-left:20px}
li{margin:3px 0}
.callout{border-left:4px solid var(--accent);background:#f0f5fe;padding:10px 14px;border-radius:4px;max-width:none}
.callout.good{border-color:var(--good);background:#eef8f2}
.callout.fair{border-color:var(--fair);background:#fdf5e8}
.callout.bad{border-color:var(--bad);background:#fdf0ef}
.tiles{display:flex;flex-wrap:wrap;gap:12px;margin:0 0 18px}
.tile{flex:1 1 150px;background:#fff;border:1px solid var(--line);border-radius:10px;padding:14px 16px}
.tile b{display:block;font-size:22px;line-height:1.25}
.tile span{color:var(--soft);font-size:14px}
section .tile{background:var(--ground)}
figure{margin:6px 0 14px}
img{display:block;max-width:100%;height:auto;border-radius:4px}
figcaption{color:var(--soft);font-size:14px;margin-top:6px;max-width:82ch}
.wide{overflow-x:auto;margin:0 0 12px}
table{border-collapse:collapse;width:100%;font-size:14.5px}
th{text-align:left;color:var(--soft);font-weight:600;border-bottom:2px solid var(--line);padding:6px 10px 6px 0;
white-space:nowrap}
td{border-bottom:1px solid var(--line);padding:7px 10px 7px 0;vertical-align:top}
td:last-child:not(.n){min-width:13em}
tr:last-child td{border-bottom:0}
.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.bar{display:flex;align-items:center;gap:8px;min-width:150px}
.bar i{flex:1 0 64px;height:9px;background:#e6ebf1;border-radius:5px;overflow:hidden}
.bar em{display:block;height:100%;background:var(--accent)}
.bar span{min-width:44px;white-space:nowrap;font-variant-numeric:tabular-nums}
pre{background:var(--ground);border:1px solid var(--line);border-radius:6px;padding:10px 12px;overflow-x:auto;
font:13.5px/1.45 ui-monospace,SFMono-Regular,Menlo,Consolas,monospace;margin:0 0 12px}
@media print{body{background:#fff;font-size:11pt}main{max-width:none;padding:0}
section,.tile{border-color:#ccc;break-inside:avoid}figure,tr,.callout{break-inside:avoid}
*{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
"""
