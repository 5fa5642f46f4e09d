"""Profiles that are half right: diagnoses of recordings whose sensor has one value otherwise, or lacks one effect.

    ./run python benchmarks/half_right.py                                   paper with each effect in turn
    ./run python benchmarks/half_right.py --profile d435 --effect matching_window

Each parameter that fits vary is twice as far from doing nothing, half as far where there is no more, or another whole
number; of a profile's own effects each is left out, too. The recordings are by depthsim's own formulas. So this says
nothing of whether causes are told apart by what is real, only that fits come from one value to another.
"""

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, NamedTuple

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from depthsim.gap import diagnose
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.sensor import load_profile
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.sensor.parameter import Parameter, learned_of, parameters_of


class Case(NamedTuple):
    """Which effect is otherwise and how, the simulator's effects, and the recording's."""

    effect: str
    what: str
    base: tuple[Effect, ...]
    recorded: tuple[Effect, ...]


def cases(profile: str, effects: Sequence[str]) -> Iterator[Case]:
    """Every value of every effect, on top of a profile or in it."""
    base = load_profile(profile).effects
    mine = {effect.id: effect for effect in base}
    for name in effects or (effect_ids() if profile == "paper" else mine):
        kind = effect_class(name)
        there = mine.get(name) or kind(**kind.shown)
        rest = tuple(one for one in base if one.id != name and not (kind.law and one.law == kind.law))
        for key, one in parameters_of(kind).items():
            is_fitted = not (one.frozen or one.by_material or (learned_of(kind) and key != "amplitude"))
            if is_fitted and (other := _with_another(there, key, one)) is not None:
                what = f"{key} {getattr(there, key):g} → {getattr(other, key):g}"
                yield Case(name, what, (*rest, there), (*rest, other))
        if name in mine:
            yield Case(name, "left out", base, rest)


def _with_another(effect: Effect, name: str, one: Parameter) -> Effect | None:
    value = getattr(effect, name)
    wholes = [start for start in one.starts if start != value] if isinstance(one.starts, Sequence) else []
    neutral = one.neutral or 0
    values = wholes[:1] if one.whole else [neutral + part * (value - neutral) for part in (2, 0.5)]
    for other in values:
        try:
            found = type(effect)(**{**effect.model_dump(), name: other})
        except ValidationError:
            continue
        if getattr(found, name) != value:
            return found
    return None


def main(
    profile: Annotated[str, typer.Option(help="paper, on top of which is every effect, or another profile.")] = "paper",
    effect: Annotated[list[str] | None, typer.Option(help="These effects only.")] = None,
    scene: Annotated[str, typer.Option(help="A built-in scene.")] = "office",
    frames: Annotated[int, typer.Option(min=10, help="Of each recording.")] = 36,
    size: Annotated[str, typer.Option(help="WIDTHxHEIGHT of the pictures.")] = "424x240",
) -> None:
    """Print for each what the diagnosis says."""
    camera = preset("d435", *(int(word) for word in size.split("x"))).model_copy(update={"rate": 10.0})
    table, count = Table("recorded otherwise", "verdict", "causes", "closed"), {"right": 0, "no gap": 0, "else": 0}
    for case in cases(profile, effect or []):
        with TemporaryDirectory(prefix="depthsim_half_right_") as folder:
            generate(
                scene, None, camera, case.recorded, Path(folder) / "run", frames=frames, streams=("depth",), seed=11
            )
            found = diagnose(Path(folder) / "run", sensor=case.base, tasks=False)
        causes = [cause.effect for cause in found.causes]
        is_right = found.verdict == "explained" and causes == [case.effect]
        count["right" if is_right else "no gap" if found.verdict == "no_gap" else "else"] += 1
        closed = " ".join(f"{cause.closed_fraction:.0%}" for cause in found.causes)
        name = f"{case.effect}: {case.what}"
        print(f"{name}: {found.verdict} {', '.join(causes)} {closed}", file=sys.stderr, flush=True)
        table.add_row(name, found.verdict, ", ".join(causes), closed)
    Console(width=120).print(table)
    print(f"explained by that effect alone: {count['right']}; no gap: {count['no gap']}; otherwise: {count['else']}")


if __name__ == "__main__":
    typer.run(main)
