"""Command lines in Markdown: those of code blocks, and those between backticks."""

import re
import shlex
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import typer
from markdown_it import MarkdownIt
from typer.main import get_command

from depthsim.cli import app

PROGRAMS = {"./run", "depthsim", "python", "python3", "pip", "git"}
"""What a command line begins with; in a block, any other program that is installed, too."""
SHELL = {"", "sh", "bash", "shell", "console"}
"""Languages of blocks that are read; `text` and all others hold no command lines."""
_NAMED = re.compile(r"`([^`]+)`")


@dataclass(frozen=True)
class Line:
    """A command line as it is written, without its comment. named: it stands between backticks, in a sentence."""

    file: str
    number: int
    text: str
    named: bool = False

    def __str__(self) -> str:
        return f"{self.file}:{self.number}: {self.text}"


def command_lines(file: Path, root: Path) -> list[Line]:
    """Those of a page, in order."""
    name, found = str(file.relative_to(root)), []
    for token in MarkdownIt("commonmark").enable("table").parse(file.read_text()):
        first = (token.map or [0])[0] + 1
        if token.type == "inline":
            inner = [child.content for child in token.children or [] if child.type == "code_inline"]
            found += [Line(name, first, text, True) for text in inner if _is_command(text, PROGRAMS)]
        elif token.type == "code_block" or (token.type == "fence" and token.info in SHELL):
            for number, text in _joined(token.content, first + (token.type == "fence")):
                if _is_command(text, PROGRAMS) or shutil.which(text.split()[0]):
                    found.append(Line(name, number, re.sub(r"\s+#\s.*", "", text)))
                else:
                    inner = _NAMED.findall(text)
                    found += [Line(name, number, one, True) for one in inner if _is_command(one, PROGRAMS)]
    return found


def _joined(text: str, first: int) -> Iterator[tuple[int, str]]:
    """The lines of a block that are not empty, each with its number; one that ends in a backslash goes on."""
    whole, begin = "", first
    for number, line in enumerate(text.splitlines(), first):
        begin = number if not whole else begin
        part = line.removesuffix("\\").strip().removeprefix("$ ")
        whole = f"{whole} {part}".strip()
        if not line.endswith("\\"):
            if whole:
                yield begin, whole
            whole = ""


def _is_command(text: str, programs: set[str]) -> bool:
    words = text.split()
    return len(words) > 1 and words[0] in programs


def is_mention(line: Line) -> bool:
    """Whether a line only names a command, or an option of it: it stands in a sentence, and what it needs is left out.

    Raises :class:`typer.BadParameter` for a command or an option that does not exist.
    """
    words = shlex.split(line.text)
    if not line.named or words[0] not in ("./run", "depthsim") or words[1] in ("test", "python", "--help"):
        return False
    commands = get_command(app)
    command = commands.get_command(typer.Context(commands), words[1])  # type: ignore[attr-defined]
    if command is None:
        raise typer.BadParameter(f"there is no command {words[1]}")
    try:
        command.make_context(words[1], words[2:])
    except Exception as error:
        if type(error).__name__ == "MissingParameter":  # typer gives it no public name
            return True
        raise typer.BadParameter(str(error)) from error
    return False
