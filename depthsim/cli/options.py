"""Options that several commands share, and their reading."""

from pathlib import Path
from typing import Annotated

import typer

from depthsim.errors import InputError

Tags = Annotated[
    list[str] | None,
    typer.Option("--tag", metavar="NAME=TAG", help="Material tag of a material in the mesh; '*' stands for any."),
]
Units = Annotated[str | None, typer.Option(help="Unit of the mesh files: m, cm, mm, in or ft.")]
Up = Annotated[str | None, typer.Option(help="The axis that points up in the mesh files: z or y.")]
MaterialsFile = Annotated[Path | None, typer.Option("--materials", help="A materials.yaml in place of depthsim's.")]


def parse_tags(pairs: list[str] | None) -> dict[str, str]:
    """``--tag NAME=TAG`` options as a mapping."""
    tags = {}
    for pair in pairs or []:
        name, equals, tag = pair.rpartition("=")
        if not equals or not tag:
            raise InputError("--tag", pair, "is not NAME=TAG", "write --tag lambert1=cement, or --tag '*=plastic'")
        tags[name] = tag
    return tags


def parse_resolution(text: str | None) -> tuple[int, int] | None:
    """``848x480`` as (width, height)."""
    if text is None:
        return None
    width, cross, height = text.lower().partition("x")
    if not (cross and width.isdecimal() and height.isdecimal() and int(width) and int(height)):
        raise InputError("--resolution", text, "is not WIDTHxHEIGHT", "write it as 848x480")
    return int(width), int(height)
