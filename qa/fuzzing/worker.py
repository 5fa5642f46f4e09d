"""Runs inputs through a reader in a process of its own, and counts what comes of them.

The process has an alarm for every input, and may not have more memory; one that dies or does not answer is counted too.
"""

import gc
import multiprocessing
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random
from typing import Any

from qa.fuzzing.inputs import Corpus
from qa.fuzzing.readers import Reader

SECONDS = 10
"""What an input may take of the processor, whatever else runs on the machine; a longer one hangs."""
MEMORY = 2 << 30
"""[bytes] What an input may take."""
BATCH = 1000
"""Inputs to a process."""
_PATIENCE = 120
"""[s] By the wall, after which a process that does not answer is ended."""
ACCEPTED, REFUSED, TRACEBACK, HANG, FULL = "accepted", "refused", "tracebacks", "hangs", "memory"
OUTCOMES = (ACCEPTED, REFUSED, TRACEBACK, HANG, FULL)


@dataclass
class Tally:
    """What came of the inputs of one reader; bad: (number of the input, what it ended in), one of each kind."""

    counts: Counter[str] = field(default_factory=Counter)
    bad: dict[str, tuple[int, str]] = field(default_factory=dict)
    seconds: float = 0.0
    slowest: tuple[float, int] = (0.0, -1)
    peak: int = 0

    @property
    def inputs(self) -> int:
        """How many there were."""
        return sum(self.counts.values())

    @property
    def failed(self) -> int:
        """How many ended in anything but a value or one line."""
        return self.counts[TRACEBACK] + self.counts[HANG] + self.counts[FULL]

    def note(self, number: int, kind: str, key: str, text: str, took: float = 0.0, peak: int = 0) -> bool:
        """Count an input; whether it ended badly in a way that was not there before."""
        self.counts[kind] += 1
        self.slowest, self.peak = max(self.slowest, (took, number)), max(self.peak, peak)
        name = f"{kind}: {key}"
        is_new = kind not in (ACCEPTED, REFUSED) and name not in self.bad
        if is_new:
            self.bad[name] = number, text
        return is_new


class Hang(BaseException):
    """An input took too long; no reader may catch it by accident."""


def _raise_hang(*_: object) -> None:
    raise Hang


def random_of(reader: Reader, seed: int, number: int) -> Random:
    """The random numbers of one input."""
    return Random(f"{seed} {reader.name} {number}")


def outcome(read: Callable[[], Any], seconds: float = SECONDS) -> tuple[str, str, str]:
    """What comes of a call: the kind, its key (where a traceback ends), and its text."""
    from depthsim.errors import InputError

    signal.signal(signal.SIGPROF, _raise_hang)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        read()
        return ACCEPTED, "", ""
    except InputError as error:
        line = str(error)
        if "\n" in line or len(line) > 5000:
            return TRACEBACK, "a refusal that is no line", line[:2000]
        if "MemoryError" in line or "Unable to allocate" in line:
            return FULL, "memory, reported as a refusal", line[:300]
        return REFUSED, "", ""
    except Hang:
        return HANG, _place(), traceback.format_exc()
    except MemoryError:
        return FULL, _place(), traceback.format_exc()
    except BaseException as error:
        return TRACEBACK, f"{type(error).__name__} {_place()}", traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def measured(read: Callable[[], Any]) -> tuple[str, str, str, float, int]:
    """:func:`outcome`, but of memory too, the processor time [s], and the most memory held so far [bytes]."""
    before, begin = peak_memory(), time.process_time()
    kind, key, text = outcome(read)
    took, peak = time.process_time() - begin, peak_memory()
    if kind in (ACCEPTED, REFUSED) and peak > max(MEMORY, before):
        kind, key, text = FULL, "peak", f"{peak / 2**20:.0f} MB"
    return kind, key, text, took, peak


def _place() -> str:
    """The innermost line of our own that a traceback goes through."""
    frames = traceback.extract_tb(sys.exc_info()[2])
    own = [frame for frame in frames if "/depthsim/" in frame.filename or "/viewer/" in frame.filename]
    last = (own or list(frames))[-1]
    return f"{Path(last.filename).parent.name}/{Path(last.filename).name}:{last.lineno}"


def run_inputs(reader: Reader, seed: int, numbers: range, seconds: float | None = None) -> Tally:
    """The inputs of some numbers, in processes of a thousand each, for so many ``seconds`` at most."""
    tally = Tally()
    _warm(reader)
    begin, at = time.monotonic(), numbers.start
    until = None if seconds is None else begin + seconds
    while at < numbers.stop and (until is None or time.monotonic() < until):
        at = _batch(reader, seed, range(at, min(at + BATCH, numbers.stop)), tally, until)
    tally.seconds += time.monotonic() - begin
    return tally


def _warm(reader: Reader) -> None:
    """Import and compile once, so that the processes need not, and make sure that the seed itself is valid."""
    with tempfile.TemporaryDirectory(dir=fast_folder()) as home, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        corpus = Corpus(reader, Path(home))
        reader.read(corpus.folder, corpus.out)


def _batch(reader: Reader, seed: int, numbers: range, tally: Tally, until: float | None) -> int:
    """One process; gives back the number that comes next, after a death the one after the deadly input."""
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe(duplex=False)
    with tempfile.TemporaryDirectory(dir=fast_folder()) as home:
        process = context.Process(target=_work, args=(reader, seed, numbers, there, home, until), daemon=True)
        process.start()
        there.close()
        at = numbers.start
        try:
            while here.poll(_PATIENCE):
                number, kind, key, text, took, peak = here.recv()
                if kind == "end":
                    return number
                at = number + 1
                tally.note(number, kind, key, text, took, peak)
            tally.note(at, HANG, "does not answer", "the process had to be killed")
        except EOFError:
            process.join()
            tally.note(at, TRACEBACK, f"died {process.exitcode}", f"the process ended with {process.exitcode}")
        finally:
            process.kill()
            process.join()
            here.close()
    return at + 1


def _work(reader: Reader, seed: int, numbers: range, pipe: Connection, home: str, until: float | None) -> None:
    """In the process: one input after the other, each reported."""
    gc.freeze()  # what is shared with the process before: to look through it for garbage would copy it all
    warnings.simplefilter("ignore")
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)
    corpus = Corpus(reader, Path(home))
    limit_memory()
    number = numbers.start
    for number in numbers:
        if until is not None and time.monotonic() > until:
            pipe.send((number, "end", "", "", 0.0, 0))
            return
        with corpus.broken(random_of(reader, seed, number)) as folder:
            reported = measured(lambda folder=folder: reader.read(folder, corpus.out))  # type: ignore[misc]
        pipe.send((number, *reported))
        if number % 100 == 0:
            gc.collect()
    pipe.send((number + 1, "end", "", "", 0.0, 0))


def limit_memory() -> None:
    """Let this process have 2 GB of addresses more than it has now."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + MEMORY,) * 2)


def peak_memory() -> int:
    """[bytes] The most that this process has held."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def fast_folder() -> str | None:
    """A folder in memory, where there is one."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
