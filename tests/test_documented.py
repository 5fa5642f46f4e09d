"""Every command line of README and docs is run in order, as it is written, in a copy of the checkout.

What cannot be is in the table of benchmarks/documented/table.py, each line with its reason; a line that has no rule and
does not end by 0 fails. `./run python benchmarks/newcomer.py --whole` does the same at full length from nothing.
"""

import subprocess
import sys
import time
from pathlib import Path

import pytest
import typer

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.documented import clone as documented
from benchmarks.documented.clone import ROOT, Clone, pages
from benchmarks.documented.lines import Line, command_lines, is_mention
from benchmarks.documented.table import RULES, How, step_of

PAGES = [page for page in pages() if any(not is_mention(line) for line in command_lines(page, ROOT))]


@pytest.mark.parametrize("page", PAGES, ids=[page.name for page in PAGES])
def test_every_command_line_runs(page: Path, tmp_path: Path) -> None:
    there, faults = Clone(tmp_path), []
    for line in command_lines(page, ROOT):
        if not is_mention(line):  # else its command and options have been looked up
            done = there.run(line)
            if done.fault:
                faults.append(f"{line}\n  run as: {done.step.text}\n  {done.fault}")
    assert not faults, "\n".join(faults)


def lines_of(text: str, folder: Path) -> list[Line]:
    (folder / "page.md").write_text(text)
    return command_lines(folder / "page.md", folder)


MARKDOWN = """
# Page

Run `./run test` or `depthsim view x`, not `run` or `materials.yaml`; `depthsim slam` says more.

    depthsim generate office \\
        --out run            # a run
    --seed N                 the seed, as of `depthsim generate a --out b`
    REPORT/index.html

```sh
$ python -m viewer run
cp a b
```
```yaml
pip install: no
```
```python
depthsim = 1
```
| key | what |
| --- | --- |
| a | `pip install .` |
"""


def test_command_lines_are_found_wherever_they_stand(tmp_path: Path) -> None:
    found = lines_of(MARKDOWN, tmp_path)
    assert [(line.number, line.text, line.named) for line in found] == [
        (4, "./run test", True),
        (4, "depthsim view x", True),
        (4, "depthsim slam", True),
        (6, "depthsim generate office --out run", False),
        (8, "depthsim generate a --out b", True),
        (12, "python -m viewer run", False),
        (13, "cp a b", False),
        (23, "pip install .", True),
    ]


def test_a_name_of_a_command_is_no_line_to_run_and_has_to_exist(tmp_path: Path) -> None:
    named = lines_of(
        "`depthsim slam` `depthsim sweep --dry-run` `depthsim view x` `./run --help` `./run test`", tmp_path
    )
    assert [is_mention(line) for line in named] == [True, True, False, False, False]
    for wrong in ("depthsim slamm", "depthsim slam --wiht x"):
        with pytest.raises(typer.BadParameter):
            is_mention(Line("page.md", 1, wrong, True))
    assert not is_mention(Line("page.md", 1, "depthsim slam")), "in a block it is run, and fails"


def test_no_line_is_left_out_but_those_that_say_why() -> None:
    left = {line.text for page in pages() for line in command_lines(page, ROOT) if step_of(line, True).how is How.LEAVE}
    simulators = {"pip install mujoco", "pip install pybullet"}  # of those who use them: nothing here needs them
    assert left <= {"./run test", "pip install atheris", *simulators}
    assert all(rule.why for rule in RULES)


def test_what_goes_wrong_is_reported(tmp_path: Path) -> None:
    there = Clone(tmp_path)
    for text, fault in {
        "depthsim generate nowhere --out x": "exit status 2: nowhere: no such scene",
        "pip install '.[nothing]'": "does not provide the extra 'nothing'",
        "depthsim view nowhere": "showed no page: nowhere",
        "no-such-program": "exit status 127",
    }.items():
        assert fault in there.run(Line("page.md", 1, text)).fault


def test_a_line_that_hangs_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(documented, "PATIENCE", 0.2)
    assert Clone(tmp_path).run(Line("page.md", 1, "sleep 1000.25")).fault == "did not end in 0.2 s"

    def there() -> bool:
        return "1000.25" in subprocess.run(["ps", "-eo", "args"], capture_output=True, text=True, check=True).stdout

    until = time.monotonic() + 20
    while there() and time.monotonic() < until:  # what is killed is seen until the system has cleared it away
        time.sleep(0.1)
    assert not there()
