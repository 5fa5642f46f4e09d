"""Worker processes of this machine. One that dies is replaced.

Plain processes over pipes, with JSON in between: started anew rather than forked, as threads, numba and Embree do not
outlive a fork.
"""

import json
import logging
import os
import selectors
import signal
import subprocess
import sys
import tempfile
import time
from collections import deque
from contextlib import suppress
from typing import IO

from depthsim.errors import InputError
from depthsim.sweep.events import Event, Job, event_of, lost

_log = logging.getLogger(__name__)

AHEAD = 2
"""Jobs that a worker holds: the one it makes, and the next, so that it never waits for the driver."""
STALL = 900.0
"""[s] A worker that has not finished one frame in this time counts as stuck, and is ended."""
_STILLBORN = 3
"""Workers that may die in turn before they are ready."""


class _Worker:
    """One process with its jobs."""

    def __init__(self, target: str) -> None:
        self.jobs: deque[Job] = deque()
        self.ready, self.rest = False, b""
        self.heard = time.monotonic()
        self.errors: IO[bytes] = tempfile.TemporaryFile()  # noqa: SIM115 - closed by end()
        environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "depthsim.sweep.worker"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.errors, env=environment,
        )  # fmt: skip
        assert self.process.stdout is not None
        os.set_blocking(self.process.stdout.fileno(), False)
        self.send({"target": target})

    def send(self, message: dict[str, object]) -> None:
        """Write a line. A worker that has just died is found when its output ends."""
        assert self.process.stdin is not None
        try:
            self.process.stdin.write(json.dumps(message).encode() + b"\n")
            self.process.stdin.flush()
        except OSError:
            pass

    def lines(self) -> tuple[list[bytes], bool]:
        """The whole lines that have come, and whether the output has ended."""
        assert self.process.stdout is not None
        data, ended = b"", False
        try:
            data = os.read(self.process.stdout.fileno(), 1 << 16)
            ended = not data
        except BlockingIOError:
            pass
        *whole, self.rest = (self.rest + data).split(b"\n")
        return whole, ended

    def end(self) -> None:
        """Kill the process; nothing that it writes is ever half there."""
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.errors):
            if stream is not None:
                with suppress(OSError):  # what was still to be written to it
                    stream.close()

    def last_words(self) -> str:
        """The last line of what it wrote to its standard error."""
        self.errors.seek(0)
        lines = self.errors.read().decode(errors="replace").strip().splitlines()
        return lines[-1] if lines else ""


class Pool:
    """``count`` workers on the plan of ``target``. lost: how many have died and were replaced."""

    def __init__(self, target: str, count: int, stall: float = STALL) -> None:
        self._target, self._stall = target, stall
        self._selector = selectors.DefaultSelector()
        self._workers: list[_Worker] = []
        self._stillborn = self.lost = 0
        self._notes: set[str] = set()
        for _ in range(count):
            self._start()

    def _start(self) -> None:
        worker = _Worker(self._target)
        self._workers.append(worker)
        assert worker.process.stdout is not None
        self._selector.register(worker.process.stdout, selectors.EVENT_READ, worker)

    @property
    def pids(self) -> list[int]:
        """The process ids of the workers."""
        return [worker.process.pid for worker in self._workers]

    def free(self) -> int:
        """How many more jobs can be taken now."""
        return sum(AHEAD - len(worker.jobs) for worker in self._workers)

    def submit(self, job: Job) -> None:
        """Give a job to the worker that has the fewest."""
        worker = min(self._workers, key=lambda worker: (len(worker.jobs), not worker.ready))
        if not worker.jobs:
            worker.heard = time.monotonic()
        worker.jobs.append(job)
        worker.send({"run": job.run, "expect": job.expect})

    def wait(self, seconds: float) -> list[Event]:
        """What the workers report, after at most ``seconds``; nothing if nothing has happened."""
        events: list[Event] = []
        for key, _ in self._selector.select(seconds):
            worker: _Worker = key.data
            lines, ended = worker.lines()
            worker.heard = time.monotonic()
            for line in lines:
                message = json.loads(line)
                if message["kind"] == "ready":
                    worker.ready, self._stillborn = True, 0
                    continue
                if message["kind"] == "note":
                    self._note(message["text"])
                    continue
                event = event_of(message)
                if event.kind != "frame":
                    worker.jobs.popleft()
                events.append(event)
            if ended:
                events += self._replace(worker)
        late = time.monotonic() - self._stall
        for worker in self._workers:
            if worker.jobs and worker.heard < late:
                worker.process.kill()  # its end is read at the next turn
        return events

    def _note(self, text: str) -> None:
        """Log what a worker has logged; what they all say, once."""
        if text not in self._notes:
            self._notes.add(text)
            _log.info("%s", text)

    def _replace(self, worker: _Worker) -> list[Event]:
        """Start another worker; the jobs of the dead one go back."""
        assert worker.process.stdout is not None
        self._selector.unregister(worker.process.stdout)
        self._workers.remove(worker)
        words = worker.last_words()
        worker.end()
        self.lost += 1
        if not worker.ready:
            self._stillborn += 1
            if self._stillborn > _STILLBORN + len(self._workers):
                raise InputError(
                    "worker", "", f"does not start ({words or _death(worker)})", "fix the reason given there"
                )
        self._start()
        return [
            lost(job.run, _death(worker)) if place == 0 and worker.ready else Event("back", job.run)
            for place, job in enumerate(worker.jobs)
        ]

    def close(self) -> None:
        """End all workers."""
        for worker in self._workers:
            worker.end()
        self._workers.clear()
        self._selector.close()


def _death(worker: _Worker) -> str:
    code = worker.process.returncode
    if code is not None and code < 0:
        try:
            return signal.Signals(-code).name
        except ValueError:
            return f"signal {-code}"
    return f"exit status {code}"
