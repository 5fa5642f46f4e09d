"""Inputs that libFuzzer chooses by what they reach in our code (atheris), by its mutations and by ours in turn.

An input is a byte that says which file of the reader's folder it replaces, and the content of that file. This module is
the process that libFuzzer takes over; :func:`run_guided` starts it, again after an input that ends it.
"""

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, NoReturn

if TYPE_CHECKING:
    from qa.fuzzing.readers import Reader
    from qa.fuzzing.worker import Tally

_HERE = Path(__file__).resolve().parents[2]
_REPORTED = 50
"""Inputs between two reports of the process, which is ended without a word where an input kills it."""
_ROOM = 4096
"""[bytes] An input may be so much longer than twice the longest valid file."""


def missing() -> str:
    """Why there is no atheris; empty where there is."""
    return "" if importlib.util.find_spec("atheris") else "atheris is not installed: pip install atheris"


def run_guided(reader: "Reader", seed: int, inputs: int, seconds: float | None, keep: Path) -> "Tally":
    """So many inputs, or as many as ``seconds`` allow. ``keep``: for those that end badly."""
    from qa.fuzzing.worker import TRACEBACK, Tally, fast_folder

    tally, begin = Tally(), time.monotonic()
    keep.mkdir(parents=True, exist_ok=True)
    while tally.inputs < inputs and (seconds is None or time.monotonic() - begin < seconds):
        left = 0.0 if seconds is None else seconds - (time.monotonic() - begin)
        with tempfile.TemporaryDirectory(dir=fast_folder()) as home:
            task = {
                "reader": reader.name,
                "seed": seed + tally.inputs,
                "inputs": inputs - tally.inputs,
                "seconds": left,
            }
            task |= {"home": home, "keep": str(keep)}
            command = [sys.executable, "-m", "qa.fuzzing.guided", json.dumps(task)]
            with Path(home, "log").open("wb") as log:
                status = subprocess.run(command, cwd=_HERE, stdout=log, stderr=log, check=False).returncode
            report = Path(home, "report.json")
            reported = json.loads(report.read_text()) if report.exists() else {"counts": {}, "bad": {}}
            tally.counts.update(reported["counts"])
            for key, (number, text) in reported["bad"].items():
                tally.bad.setdefault(key, (number, text))
            tally.slowest = max(tally.slowest, tuple(reported.get("slowest", (0.0, -1))))
            tally.peak = max(tally.peak, reported.get("peak", 0))
            if status != 0:
                last = Path(home, "log").read_text(errors="replace").strip().splitlines()[-12:]
                tally.counts[TRACEBACK] += 1
                tally.bad.setdefault(f"{TRACEBACK}: ended with {status}", (tally.inputs, "\n".join(last)))
                input_file = Path(home, "input")
                if input_file.exists():
                    (keep / f"{reader.name} {seed + tally.inputs} ended").write_bytes(input_file.read_bytes())
                if not reported["counts"]:
                    break  # it does not even begin
    tally.seconds = time.monotonic() - begin
    return tally


class Fuzzed:
    """The reader in libFuzzer's process."""

    def __init__(self, task: dict[str, str | int | float]) -> None:
        from qa.fuzzing.inputs import Corpus
        from qa.fuzzing.readers import READERS
        from qa.fuzzing.worker import Tally

        self._reader = READERS[str(task["reader"])]
        self._home, self._keep = Path(str(task["home"])), Path(str(task["keep"]))
        self._most, self._seconds = int(task["inputs"]), float(task["seconds"])
        self._corpus, self._tally, self._begin = Corpus(self._reader, self._home), Tally(), time.monotonic()
        self._targets = self._corpus.targets
        self._reader.read(self._corpus.folder, self._corpus.out)  # the valid one must be taken

    def seeds(self, folder: Path) -> int:
        """Write the valid files as inputs; gives back the length that no input may pass."""
        folder.mkdir()
        for index, (_, data) in enumerate(self._targets[:256]):
            (folder / str(index)).write_bytes(bytes([index]) + data)
        return 2 * max(len(data) for _, data in self._targets) + _ROOM

    def mutate(self, data: bytes, longest: int, seed: int) -> bytes:
        """One mutation: libFuzzer's of what it found, or ours, which know the format, of a valid file."""
        import atheris

        from qa.fuzzing.containers import by_suffix, mutate_db3

        rng = Random(seed)
        if data and rng.random() < 0.6:
            return data[:1] + bytes(atheris.Mutate(data[1:], longest - 1))
        index = rng.randrange(min(256, len(self._targets)))
        name, content = self._targets[index]
        is_base = name.endswith(".db3")
        try:
            changed = mutate_db3(content, rng, self._home) if is_base else by_suffix(name)(content, rng)
        except MemoryError:  # a database of gigabytes, too long for libFuzzer
            changed = content
        return bytes([index]) + changed[: longest - 1]

    def one(self, data: bytes) -> None:
        """Read one input."""
        from qa.fuzzing.worker import measured

        if not data:
            return
        (self._home / "input").write_bytes(data)
        with self._corpus.holding(data[0] % len(self._targets), data[1:]) as folder:
            reported = measured(lambda: self._reader.read(folder, self._corpus.out))
        tally, number = self._tally, self._tally.inputs
        is_new = tally.note(number, *reported)
        if is_new:
            (self._keep / f"{self._reader.name} {number}").write_bytes(data)
        late = 0 < self._seconds < time.monotonic() - self._begin
        if late or tally.inputs >= self._most or tally.inputs % _REPORTED == 0 or is_new:
            self._report()
        if late or tally.inputs >= self._most:
            os._exit(0)  # libFuzzer's own end is no other

    def _report(self) -> None:
        tally = self._tally
        reported = {"counts": tally.counts, "bad": tally.bad, "slowest": tally.slowest, "peak": tally.peak}
        (self._home / "report.new").write_text(json.dumps(reported))
        (self._home / "report.new").replace(self._home / "report.json")


def _compiled() -> list[str]:
    """Modules that numba compiles: it cannot read what atheris puts into them."""
    names = []
    for package in ("depthsim", "viewer"):
        for file in (_HERE / package).rglob("*.py"):
            text = file.read_text()
            if any(word in text for word in ("numba", "njit", "@kernel")):
                names.append(".".join(file.relative_to(_HERE).with_suffix("").parts).removesuffix(".__init__"))
    return names


def _main() -> NoReturn:
    import atheris

    from qa.fuzzing.worker import limit_memory

    task = json.loads(sys.argv[1])
    warnings.simplefilter("ignore")
    with atheris.instrument_imports(include=["depthsim", "viewer", "rosbags", "yaml"], exclude=_compiled()):
        fuzzed = Fuzzed(task)
        folder = Path(task["home"], "corpus")
        longest = fuzzed.seeds(folder)
        limit_memory()
        # A seed of 0 is libFuzzer's word for a random one. The alarm and the memory are ours, see worker.py.
        options = [
            f"-seed={1 + task['seed'] % 2**31}",
            f"-max_len={longest}",
            "-timeout=600",
            "-len_control=0",
            "-rss_limit_mb=0",
        ]
        atheris.Setup(["fuzz", *options, str(folder)], fuzzed.one, custom_mutator=fuzzed.mutate)
        atheris.Fuzz()
    raise SystemExit("libFuzzer has ended")


if __name__ == "__main__":
    _main()
