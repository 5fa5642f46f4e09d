"""What is done with a command line that cannot be run as it is written. Any other is run as it is.

No line is left out but by a rule that says why.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from benchmarks.documented.lines import Line


class How(Enum):
    """How a line is run."""

    RUN = "to its end, which has to be by 0"
    SERVE = "until it shows a page, and then ended by Ctrl-C"
    LEAVE = "not at all"


@dataclass(frozen=True)
class Rule:
    """For the lines that ``pattern`` is found in.

    put: takes the place of what was found, as of :func:`re.sub`. add: words at the end; of an option that is given
    twice, the last counts. first: a shell's line that is run before. short: only where time is short.
    """

    pattern: str
    why: str
    how: How = How.RUN
    put: str | None = None
    add: str = ""
    first: str = ""
    short: bool = False


SMALL = "--frames 9 --resolution 208x120"
RULES = [
    Rule(r"^\./run test", "it is what runs these lines", How.LEAVE),
    Rule(r"^pip install atheris", "its build takes a compiler", How.LEAVE),
    Rule(r"^pip install (mujoco|pybullet)", "a simulator that some users have, and nothing here needs", How.LEAVE),
    Rule(r"^pip install", "no network", add="--dry-run -q --no-index --no-build-isolation", short=True),
    Rule(r"\bview |^python -m viewer", "it stays open", How.SERVE),
    Rule(r"^\./run python \S+\.py .*", "hours in all", add="--help"),
    Rule(
        r"^\./run python (\S+\.py)$", "hours in all: it is loaded and not run",
        put=r"""./run python -c "import runpy; runpy.run_path('\1', run_name='loaded')" """,
    ),
    Rule(r"\.\./shared/data/\w+", "real recordings beside the checkout, and minutes of each", put="recording"),
    Rule(r"s3://bucket", "a folder is the store", put="file://$PWD/bucket"),
    Rule(r"--ray HOST:6379", "a cluster takes 20 s to start; tests/sweep/ has one", put="", short=True),
    Rule(r"--ray HOST:6379", "the cluster is this machine", put="--ray local"),
    Rule(r"SYSTEM", "a placeholder", put="kiss-icp"),
    Rule(r" \[more logs\]", "a placeholder", put=""),
    Rule(r"import viewer.bag --out recording", "another recording than the diagnosis'", first="rm -rf recording"),
    Rule(r"reconstruct (\w+)$", "of a recording without a scene", first=r"rm -f \1/scene.*"),
    Rule(r"generate (office|office_moving|race|sponza.glb)\b", "time", add=SMALL, short=True),
    Rule(r"sweep sweep.yaml --out", "time: a worker takes longest to start", add="--workers 1", short=True),
    Rule(r"slam \S+ --sweep", "time", add="--with kiss-icp --profiles clean --speeds 1", short=True),
]  # fmt: skip


@dataclass(frozen=True)
class Step:
    """A line with what the rules make of it."""

    line: Line
    text: str
    how: How
    first: Sequence[str]
    why: Sequence[str]


def step_of(line: Line, short: bool) -> Step:
    """Apply all rules that the line meets, in their order."""
    text, how, first, why = line.text, How.RUN, [], []
    for rule in RULES:
        found = re.search(rule.pattern, text)
        if found is None or (rule.short and not short):
            continue
        if rule.put is not None:
            text = re.sub(rule.pattern, rule.put, text)
        text = f"{text} {rule.add}".strip()
        how = rule.how if rule.how is not How.RUN else how
        first += [found.expand(rule.first)] if rule.first else []
        why.append(rule.why)
    return Step(line, text, how, first, why)
