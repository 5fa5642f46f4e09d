"""What all YAML of ours goes through. That every reader survives broken files is in test_fuzz.py."""

from pathlib import Path

import pytest
import yaml

import depthsim
from depthsim.errors import InputError
from depthsim.yamlfile import MOST_LEVELS, parse_yaml

FILE = Path("some.yaml")


@pytest.mark.parametrize("file", sorted(Path(depthsim.__file__).parent.rglob("*.yaml")), ids=lambda file: file.stem)
def test_the_files_that_come_with_us_are_what_plain_pyyaml_reads(file: Path) -> None:
    assert parse_yaml(file.read_text(), file) == yaml.safe_load(file.read_text())


@pytest.mark.parametrize(("start", "end"), [("[", "]"), ("{a: ", "}"), ("- ", "")])
def test_a_document_that_is_deeper_than_any_of_ours_is_reported_and_does_not_end_the_process(
    start: str, end: str
) -> None:
    deep = start * MOST_LEVELS + "1" + end * MOST_LEVELS
    assert parse_yaml(deep, FILE)
    for times in (MOST_LEVELS + 1, 50_000):
        with pytest.raises(InputError, match="nested deeper than 100"):
            parse_yaml(start * times + "1" + end * times, FILE)


@pytest.mark.parametrize(
    ("text", "line"),
    [("a: [", 1), ("a: 1\nb: [1,\n", 3), ("a: 1\nb: c: d", 2), ("a: 1\n\tb: 2", 2), ("a: 1\na: 2", 2), ("x: *y", 1)],
)
def test_the_line_of_a_fault_is_reported(text: str, line: int) -> None:
    with pytest.raises(InputError, match=f"some.yaml: line {line}: is not YAML"):
        parse_yaml(text, FILE)


def test_aliases_may_not_hold_themselves_nor_stand_for_a_billion_values() -> None:
    bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n" + "".join(
        f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]\n" for n in range(1, 9)
    )
    for text, problem in ((bomb, "aliases for over"), ("a: &a [*a]", "an alias that holds itself")):
        with pytest.raises(InputError, match=problem):
            parse_yaml(text, FILE)
