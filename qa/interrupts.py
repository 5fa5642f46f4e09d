"""Ctrl-C at random moments of every long command, counted: `./run python qa/interrupts.py [--moments 20]`.

The signal goes to the whole group of processes, as from a terminal. A command has to end by 130 and a line, `stopped`,
with nothing half-written beside; `view` ends by 0 and nothing. What comes before Python has loaded our first module or
after our last line is counted apart: Python's own start and end are silent, or a traceback without a line of ours.
"""

import argparse
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.chromium import chromium, missing
from benchmarks.measuring import machine

DEPTHSIM = [sys.executable, "-m", "depthsim"]
TOLD, FINISHED, PYTHON, WRONG = "as it should be", "had finished", "in Python's own start or end", "wrong"
OUTCOMES = (TOLD, FINISHED, PYTHON, WRONG)
PATIENCE = 60.0
"""[s] A command that has not ended by then hangs."""
SWEEP = """
name: interrupted
scenes: [wall]
seeds: 8
frames: 6
camera: {name: small, width: 212, height: 120, fx: 106, fy: 106, cx: 105.5, cy: 59.5, baseline: 0.05, rate: 30}
"""


def commands(home: Path) -> dict[str, list[str]]:
    """What is interrupted; ``OUT`` is a path where nothing is."""
    run, bag, sweep = home / "run", home / "bag", home / "sweep.yaml"
    subprocess.run(
        [*DEPTHSIM, "generate", "office", "--frames", "20", "--resolution", "424x240", "--out", run], check=True
    )
    subprocess.run([*DEPTHSIM, "export", run, "--to", "ros2", "--out", bag], check=True)
    sweep.write_text(SWEEP)
    return {
        "generate": ["generate", "office", "--sensor", "d435", "--out", "OUT"],
        "sweep": ["sweep", str(sweep), "--workers", "2", "--out", "OUT"],
        "fly": ["fly", "lemniscate:size=20/10,center=0/0/3", "--speed", "5", "--out", "OUT"],
        "inspect": ["inspect", str(run)],
        "diagnose": ["diagnose", str(run), "--sensor", "clean", "--out", "OUT"],
        "export": ["export", str(run), "--to", "ros2", "--out", "OUT"],
        "import": ["import", str(bag), "--out", "OUT"],
        "reconstruct": ["reconstruct", str(run), "--out", "OUT"],
        "slam": ["slam", str(run), "--with", "open3d-odometry", "--out", "OUT"],
        "view": ["view", "office", "--port", "0"],
    }


def duration(words: list[str], out: str, at_most: float) -> float:
    """How long a command takes that is let be [s]."""
    begin = time.monotonic()
    process = start([*DEPTHSIM, *(out if word == "OUT" else word for word in words)])
    try:
        process.communicate(timeout=at_most)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
    return time.monotonic() - begin


def interrupt(words: list[str], after: float, folder: Path) -> tuple[str, str]:
    """What comes of one Ctrl-C, and what to show of it if it is wrong."""
    command = [*DEPTHSIM, *(str(folder / "out") if word == "OUT" else word for word in words)]
    process = start(command)
    try:
        process.communicate(timeout=after)
        return FINISHED, ""
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGINT)
    return judge(process, words[0], folder)


def start(command: list[str]) -> subprocess.Popen[str]:
    """A command in a group of its own, which heeds Ctrl-C even where the shell that started us lets it be ignored."""
    code = "import os, signal, sys; signal.signal(signal.SIGINT, signal.SIG_DFL); os.execv(sys.argv[1], sys.argv[1:])"
    pipe = subprocess.PIPE
    wrapped = [sys.executable, "-S", "-c", code, *command]
    return subprocess.Popen(wrapped, stdout=pipe, stderr=pipe, text=True, start_new_session=True)


def judge(process: subprocess.Popen[str], name: str, folder: Path) -> tuple[str, str]:
    """What an interrupted process came to."""
    try:
        printed, reported = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return WRONG, "hangs"
    status, lines = process.returncode, reported.strip().splitlines()
    half = [str(path) for path in folder.rglob(".*") if path.suffix in (".tmp", ".part")]
    if half:
        return WRONG, f"left {', '.join(half)}"
    # Where Ctrl-C fell into an exec() of text, as in rosbags, Python ends by the signal, which shells call 130 too.
    if status in (130, -signal.SIGINT) and lines and lines[-1].startswith("stopped") and "Traceback" not in reported:
        return TOLD, ""
    if name == "view" and (status, reported) == (0, ""):
        return TOLD, ""
    if status == 0 and "Traceback" not in reported:
        return FINISHED, ""
    if status == -signal.SIGINT and not re.search(r'/(depthsim|viewer)/(?!__main__|__init__)[^"]*\.py"', reported):
        return PYTHON, ""
    return WRONG, f"status {status}: {printed[-200:]} {reported[-600:]}"


def interrupt_playing(rng: random.Random, folder: Path) -> tuple[str, str]:
    """One Ctrl-C of the viewer while a browser plays, which casts in a thread."""
    with chromium() as browser:
        process = start([*DEPTHSIM, "view", "office", "--sensor", rng.choice(["paper", "d435"]), "--port", "0"])
        assert process.stdout is not None
        address = next(found[0] for line in process.stdout if (found := re.search(r"http://\S+", line)))
        page = browser.new_page(viewport={"width": 800, "height": 600})
        page.goto(address)
        page.get_by_text("points").first.wait_for(timeout=300_000)
        page.keyboard.press("k")
        time.sleep(rng.uniform(1, 4))
        os.killpg(process.pid, signal.SIGINT)
        return judge(process, "view", folder)


def main() -> None:
    """Print the table; exit status 1 where something was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moments", type=int, default=20, help="of each command")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    rng, console = random.Random(given.seed), Console(width=150)
    counts: dict[str, Counter[str]] = {}
    bad: list[str] = []
    with tempfile.TemporaryDirectory() as home:
        for name, words in commands(Path(home)).items():
            longest = duration(words, f"{home}/whole {name}", at_most=6 if name == "view" else 20)
            counts[name] = Counter()
            for moment in track(range(given.moments), name, console=Console(stderr=True), transient=True):
                folder = Path(home, f"{name} {moment}")
                folder.mkdir()
                kind, shown = interrupt(words, rng.uniform(0.05, longest), folder)
                counts[name][kind] += 1
                bad += [f"{name}: {shown}"] if kind == WRONG else []
                shutil.rmtree(folder)
        if not missing():
            counts["view, playing"] = Counter()
            for _ in range(given.moments):
                kind, shown = interrupt_playing(rng, Path(home))
                counts["view, playing"][kind] += 1
                bad += [f"view, playing: {shown}"] if kind == WRONG else []
    table = Table("Ctrl-C of", *OUTCOMES)
    for name, tally in counts.items():
        table.add_row(name, *(str(tally[kind]) for kind in OUTCOMES))
    console.print(table)
    print("\n".join([*bad, missing(), machine()]).strip())
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
