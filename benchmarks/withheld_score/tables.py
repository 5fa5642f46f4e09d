"""The tables and the picture, on the terminal and in the results folder."""

import json
import math
from collections import Counter
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.measuring import machine
from benchmarks.withheld_score import score
from benchmarks.withheld_score.plan import TIERS, planned

Result = dict[str, Any]
_SPEED = [json.loads(json.dumps(asdict(wanted))) for wanted in planned("speed")]


def load_results(folder: Path) -> list[Result]:
    """All results in a folder, by name."""
    return [json.loads(file.read_text(encoding="utf-8")) for file in sorted((folder / "cases").glob("*.json"))]


def print_all(folder: Path, console: Console) -> None:
    """Print every table, and write them to tables.txt and confusion.png beside the results."""
    results = load_results(folder)
    parts: list[Table | str] = [f"{len(results)} cases; {machine()}"]
    good = [r for r in results if "diagnosis" in r]
    by_tier = {tier: [r for r in good if r["truth"]["tier"] == tier and not _is_speed(r)] for tier in TIERS}
    counters = {"a": score.tier_a, "b": score.tier_b, "c": score.tier_c, "d": score.tier_d}
    for tier, count in (*counters.items(), ("e", score.expert), ("f", score.expert)):
        if by_tier[tier]:
            parts.append(_counts(f"({tier}) {TIERS[tier]}", count(by_tier[tier])))
    if by_tier["a"]:
        parts += _of_tier_a(by_tier["a"], folder)
    for tier in "ef":
        if by_tier[tier]:
            parts.append(_stereo(tier, by_tier[tier]))
    if score.apart(good)[0].of:
        parts.append(_counts("an independent test (boosted trees), where the report says explained", score.apart(good)))
    parts.append(_costs(good))
    failed = [r for r in results if "error" in r]
    if failed:
        parts.append(_failures(failed))
    for part in parts:
        console.print(part)
    with (folder / "tables.txt").open("w", encoding="utf-8") as file:
        plain = Console(file=file, width=150)
        for part in parts:
            plain.print(part)


def _is_speed(result: Result) -> bool:
    return result.get("wanted") in _SPEED


def _counts(title: str, counts: list[score.Count]) -> Table:
    table = Table(title=title, title_justify="left")
    for name in ("what", "cases", "share", "95 % interval", "aim"):
        table.add_column(name, justify="left" if name == "what" else "right")
    for count in counts:
        low, high = count.interval
        aim = "" if count.target is None else f"{'under' if count.most else 'at least'} {count.target:.0%}"
        share = "" if math.isnan(count.share) else f"{count.share:.1%}"
        table.add_row(count.what, f"{count.good} / {count.of}", share, f"{low:.1%} to {high:.1%}", aim)
    return table


def _of_tier_a(results: list[Result], folder: Path) -> list[Table | str]:
    parts: list[Table | str] = []
    closed = score.closed(results)
    if closed:
        lower, middle, upper = np.quantile(closed, [0.25, 0.5, 0.75])
        parts.append(
            f"closed fraction, measured again on fresh frames: median {middle:.3f} (quartiles {lower:.3f} and "
            f"{upper:.3f}, {len(closed)} cases; aim: at least 0.9)"
        )
    parts.append(_counts("intervals", score.coverage(results)))
    for name, which in (("RMSE: what lowers it most", "rmse"), ("classifier: most important feature", "importance")):
        parts.append(_counts(f"rival, {name}", score.rival(results, which)))
    parts.append(_by_effect(results))
    rows, columns, matrix = score.confusion(results)
    parts.append(_confusions(rows, columns, matrix))
    from benchmarks.withheld_score.figure import draw_confusion

    draw_confusion(folder / "confusion.png", rows, columns, matrix)
    return parts


def _by_effect(results: list[Result]) -> Table:
    table = Table(title="(a) by effect: first cause right / cases", title_justify="left")
    for name in ("effect", "weak", "medium", "strong", "closed (median)", "misattributed to"):
        table.add_column(name, justify="left" if name in ("effect", "misattributed to") else "right")
    for effect in sorted({score.wanted(r)[0] for r in results}):
        mine = [r for r in results if score.wanted(r)[0] == effect]
        cells = []
        for strength in ("weak", "medium", "strong"):
            group = [r for r in mine if score.strength(r) == strength]
            cells.append(f"{sum(score.first(r) == effect for r in group)} / {len(group)}" if group else "")
        closed = score.closed(mine)
        wrong = Counter(score.first(r) for r in mine if score.first(r) != effect)
        text = ", ".join(f"{name} {count}" for name, count in wrong.most_common())
        table.add_row(effect, *cells, f"{np.median(closed):.2f}" if closed else "", text)
    return table


def _confusions(rows: list[str], columns: list[str], matrix: np.ndarray) -> Table:
    table = Table(title="(a) confusion: withheld, told first, cases (right ones left out)", title_justify="left")
    for name in ("withheld", "told first"):
        table.add_column(name)
    table.add_column("cases", justify="right")
    wrong = [
        (matrix[i, j], row, column) for i, row in enumerate(rows) for j, column in enumerate(columns) if row != column
    ]
    for count, row, column in sorted(wrong, key=lambda item: (-item[0], item[1], item[2])):
        if count:
            table.add_row(row, column, str(count))
    return table


def _stereo(tier: str, results: list[Result]) -> Table:
    table = Table(title=f"({tier}) what was told", title_justify="left")
    for name in ("case", "against", "verdict", "causes", "closed", "95 % interval"):
        table.add_column(name, overflow="fold")
    for r in results:
        gap = r["diagnosis"]["gap"]
        causes = ", ".join(cause["effect"] for cause in r["diagnosis"]["causes"]) or "none"
        interval = f"{gap['ci95'][0]:.2f} to {gap['ci95'][1]:.2f}"
        verdict = r["diagnosis"]["verdict"]
        table.add_row(
            r["truth"]["name"], r["truth"]["against"], verdict, causes, f"{gap['closed_fraction']:.2f}", interval
        )
    return table


def _costs(results: list[Result]) -> Table:
    table = Table(
        title="time and memory of one diagnosis (aim: 40 frames of 424x240 in 60 s and 4 GB)", title_justify="left"
    )
    for name in ("tier", "cases", "median s", "most s", "most MB"):
        table.add_column(name, justify="left" if name == "tier" else "right")
    for tier in TIERS:
        if tier == "speed":
            group = [r for r in results if _is_speed(r)]
        else:
            group = [r for r in results if r["truth"]["tier"] == tier and not _is_speed(r)]
        if group:
            seconds, peak = [r["seconds"] for r in group], max(r["peak_mb"] for r in group)
            table.add_row(tier, str(len(group)), f"{np.median(seconds):.1f}", f"{max(seconds):.1f}", f"{peak:.0f}")
    return table


def _failures(results: list[Result]) -> Table:
    table = Table(title="not counted", title_justify="left")
    for name in ("case", "at", "why"):
        table.add_column(name, overflow="fold")
    for r in results:
        wanted = r.get("truth", {}).get("name") or "_".join([r["wanted"]["tier"], *r["wanted"]["effects"]])
        table.add_row(wanted, r["stage"], r["error"])
    return table
