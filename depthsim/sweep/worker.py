"""A worker process: a line of JSON in for every job, and lines out for every frame and for what became of the job.

`python -m depthsim.sweep.worker` reads from its standard input and ends when that ends, however its driver went.
"""

import json
import logging
import os
import queue
import signal
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, BinaryIO

from depthsim.errors import InputError


def outcome(maker: Any, job: dict[str, Any], progress: Any = lambda done, total: None) -> dict[str, Any]:
    """What :meth:`Maker.make` gives for a job, or its error in one line."""
    from depthsim.sweep.work import is_fatal

    try:
        return {"kind": "done", **maker.make(job["run"], expect=job.get("expect"), progress=progress)}
    except InputError as error:
        parts, wait = (error.file, error.place, error.problem, error.fix), False
        fatal = is_fatal(error)
    except Exception as error:
        parts, wait = (f"run {job['run']}", "", one_line(error), "see whether the target can be written"), True
        fatal = is_fatal(error)
    return {"kind": "error", "run": job["run"], "parts": parts, "fatal": fatal, "wait": wait}


def one_line(error: BaseException) -> str:
    """An error that nobody foresaw, in one line: what, and where it was raised."""
    trace = error.__traceback__
    while trace is not None and trace.tb_next is not None:
        trace = trace.tb_next
    place = f" ({Path(trace.tb_frame.f_code.co_filename).name}:{trace.tb_lineno})" if trace is not None else ""
    return f"{type(error).__name__}: {' '.join(str(error).split())[:300]}{place}"


def main() -> None:
    """Take jobs until the input ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the driver's; it ends us
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # whatever a library prints is not ours
    lines: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(sys.stdin.buffer, lines), daemon=True).start()

    def send(message: dict[str, Any]) -> None:
        try:
            out.write(json.dumps(message).encode() + b"\n")
        except OSError:  # the driver has gone
            os._exit(1)

    log = logging.getLogger("depthsim")
    log.setLevel(logging.INFO)
    log.addHandler(Notes(send))
    first = json.loads(lines.get())
    from depthsim.sweep.plan import Plan
    from depthsim.sweep.target import open_target
    from depthsim.sweep.work import Maker

    target = open_target(first["target"])
    maker = Maker(Plan.from_json((target.read("plan.json") or b"").decode(), first["target"]), target)
    send({"kind": "ready"})
    while True:
        job = json.loads(lines.get())

        def progress(done: int, total: int, run: int = job["run"]) -> None:
            send({"kind": "frame", "run": run, "done": done, "total": total})

        send(outcome(maker, job, progress))


class Notes(logging.Handler):
    """Sends what is logged to the driver."""

    def __init__(self, send: Callable[[dict[str, Any]], None]) -> None:
        super().__init__()
        self._send = send

    def emit(self, record: logging.LogRecord) -> None:
        """Called with every message."""
        self._send({"kind": "note", "text": record.getMessage()})


def _read(source: BinaryIO, lines: "queue.SimpleQueue[bytes]") -> None:
    """Read on while a run is made, to end at once with the driver: a frame is whole on disk or not there at all."""
    for line in source:
        lines.put(line)
    os._exit(0)


if __name__ == "__main__":
    main()
