"""The library names arguments; the command line names its flags, in one place."""

import ast
import re
from pathlib import Path

import pytest
from shapes import MATERIALS
from typer.main import get_command
from typer.testing import CliRunner

from depthsim.cli import app, flags
from depthsim.errors import InputError
from depthsim.scenefile import load_scene

ROOT = Path(__file__).parents[2] / "depthsim"
COMMANDS = get_command(app).commands  # type: ignore[attr-defined]
ELSEWHERE = {
    "extras.py",  # calls the script ./run, whose flag that is
    "gap/report/words.py", "gap/depth/report/compare.py", "gap/flight/report/write.py",  # command lines to give
    "gap/report/page.py",  # CSS
}  # fmt: skip
LIBRARY = [file for file in sorted(ROOT.rglob("*.py")) if file.relative_to(ROOT).parts[0] != "cli"]
FLAG = re.compile(r"(?<![\w-])--[a-z][a-z-]*")


def texts(file: Path) -> list[str]:
    """The strings of a file, but the docstrings."""
    tree = ast.parse(file.read_text())
    docs = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    strings = (node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in docs)
    return [node.value for node in strings if isinstance(node.value, str)]


def test_no_library_message_names_a_flag() -> None:
    named = {str(file.relative_to(ROOT)) for file in LIBRARY for text in texts(file) if FLAG.search(text)}
    assert named == ELSEWHERE


def test_every_other_name_is_a_parameter_of_a_command() -> None:
    parameters = {parameter.name for command in COMMANDS.values() for parameter in command.params}
    assert set(flags._OTHER_NAMES.values()) <= parameters
    assert all(isinstance(command, flags.Command) for command in COMMANDS.values())


def test_the_library_names_the_argument_and_the_command_its_flag(tmp_path: Path) -> None:
    mesh = tmp_path / "lamp.obj"
    mesh.write_text("usemtl lamp\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    with pytest.raises(InputError, match="`units` yard: no such unit"):
        load_scene(mesh, units="yard", materials=MATERIALS)
    with pytest.raises(InputError, match="by `tags` NAME=TAG or by `tags:`"):
        load_scene(mesh, materials=MATERIALS)
    words = ["generate", str(mesh), "--trajectory", "hover:position=0/0/1,duration=1", "--out", str(tmp_path / "run")]
    reported = CliRunner().invoke(app, [*words, "--units", "yard"]).exception
    assert isinstance(reported, InputError) and "--units yard: no such unit" in str(reported)
    reported = CliRunner().invoke(app, words).exception
    assert isinstance(reported, InputError) and "by --tag NAME=TAG or by `tags:`" in str(reported)


@pytest.mark.parametrize(
    ("command", "text", "expected"),
    [
        ("export", "`form`: hdf5: is no format", "--to: hdf5: is no format"),
        ("sweep", "give another `target`", "give another --out"),
        ("fit-material", "`width`: is 0; `fit_floor`", "--bin: is 0; --fit-floor"),
        (
            "slam",
            "`system`: x; `rate`, `pip install 'depthsim[slam]'`",
            "--with: x; `rate`, `pip install 'depthsim[slam]'`",
        ),
    ],
)
def test_in_flags(command: str, text: str, expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise InputError(text, "", "", "")

    words = {"export": ["run", "--to", "x"], "sweep": ["file"], "fit-material": ["path"], "slam": ["run"]}[command]
    monkeypatch.setattr(COMMANDS[command], "callback", fail)
    with pytest.raises(InputError) as caught:
        COMMANDS[command].main([*words], standalone_mode=False)
    assert caught.value.file == expected
