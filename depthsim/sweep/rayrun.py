"""Workers on a Ray cluster. Ray carries our JSON as text; a worker of ours lives in each of its processes."""

import json
import os
import socket
from functools import lru_cache
from typing import Any

from depthsim.errors import InputError
from depthsim.extras import load_extra
from depthsim.sweep.events import Event, Job, event_of, lost
from depthsim.sweep.plan import Plan

LOCAL = "local"
_SPAN = 0.5
"""[s] Work that is sent at once, so that short runs are not held up by messages."""
_MOST = 64
_STARTS = 3
_KNOCK = 20.0
"""[s] How long the head of a cluster may take to answer."""


@lru_cache(maxsize=1)
def _maker(text: str, url: str) -> Any:
    """This process's maker; the scenes that it holds stay for the next jobs."""
    from depthsim.sweep.target import open_target
    from depthsim.sweep.work import Maker

    return Maker(Plan.from_json(text, url), open_target(url))


def make_runs(text: str, url: str, jobs: str) -> str:
    """What becomes of some jobs of a plan, one after another. All three, and the result, are JSON or plain text."""
    from depthsim.sweep.worker import outcome

    maker = _maker(text, url)
    results = []
    for job in json.loads(jobs):
        results.append(outcome(maker, job))
        if results[-1].get("fatal"):
            break
    return json.dumps(results)


def _knock(address: str) -> None:
    """Raise :class:`InputError` where nobody listens at ``host:port``: Ray itself would go on trying for minutes."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not (host and port.isdecimal()):
        return  # `auto`, or what Ray knows how to read
    try:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_KNOCK).close()
    except (OSError, OverflowError) as error:
        problem = f"no cluster ({error})"
        raise InputError(f"`address` {address}", "", problem, "give the address of a cluster that runs") from None


def _connect(ray: Any, keys: dict[str, Any]) -> None:
    """Begin or join a cluster. One of this machine is tried thrice: Ray gives its own processes 30 s to start."""
    tries = _STARTS if keys["address"] == LOCAL else 1
    for left in reversed(range(tries)):
        try:
            ray.init(**keys)
            return
        except Exception as error:  # of many kinds, and some of them plain Exception
            ray.shutdown()
            if not left:
                problem = f"no cluster ({' '.join(str(error).split())[:200]})"
                fix = "give the address of a cluster that runs, or leave `address` out"
                raise InputError(f"`address` {keys['address']}", "", problem, fix) from None


class RayMakers:
    """A worker for every core of a cluster.

    address: of the cluster's head (``host:6379``, ``ray://host:10001``, ``auto``), or ``local`` for one of this machine
    alone, with ``workers`` cores.
    """

    def __init__(self, plan: Plan, url: str, address: str, workers: int | None = None) -> None:
        os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
        self._ray = ray = load_extra("ray", "ray")
        keys: dict[str, Any] = {"log_to_driver": False, "logging_level": "ERROR"}
        if address == LOCAL:
            keys |= {"address": "local", "num_cpus": workers, "include_dashboard": False}
        else:
            keys |= {"address": address}
        self._own = not ray.is_initialized()
        if self._own:
            _knock(address)
            _connect(ray, keys)
        self._count = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))
        self._function = ray.remote(num_cpus=1, max_retries=0)(make_runs)
        self._text, self._url = ray.put(plan.to_json()), url
        self._sent: dict[Any, list[Job]] = {}
        self._held: list[Job] = []
        self._alone: set[int] = set()
        self._seconds = 0.0
        self.lost = 0

    @property
    def _batch(self) -> int:
        """How many runs are sent at once, by what a run has taken lately."""
        return max(1, min(_MOST, int(_SPAN / self._seconds))) if self._seconds > 0 else 1

    def free(self) -> int:
        """Two batches a core: the one that is made and the next."""
        return max(0, (2 * self._count - len(self._sent)) * self._batch - len(self._held))

    def submit(self, job: Job) -> None:
        """Hold a job until the next batch goes out."""
        self._held.append(job)

    def _send(self) -> None:
        while self._held:
            size = 1 if self._held[0].run in self._alone else self._batch
            batch, self._held = self._held[:size], self._held[size:]
            text = json.dumps([{"run": job.run, "expect": job.expect} for job in batch])
            self._sent[self._function.remote(self._text, self._url, text)] = batch

    def wait(self, seconds: float) -> list[Event]:
        """What has been made. Of a batch whose process or node died, each run is tried by itself."""
        self._send()
        if not self._sent:
            return []
        ready, _ = self._ray.wait(list(self._sent), num_returns=1, timeout=seconds)
        events: list[Event] = []
        for reference in ready:
            batch = self._sent.pop(reference)
            try:
                results = json.loads(self._ray.get(reference))
            except self._ray.exceptions.RayError as error:
                how = type(error).__name__
                self.lost += 1
                single = len(batch) == 1
                self._alone |= {job.run for job in batch}
                events += [lost(job.run, how) if single else Event("back", job.run) for job in batch]
                continue
            events += map(event_of, results)
            reported = {result["run"] for result in results}
            events += [Event("back", job.run) for job in batch if job.run not in reported]
            made = [result["seconds"] for result in results if result["kind"] == "done"]
            if made:
                mean = sum(made) / len(made)
                self._seconds = mean if not self._seconds else 0.7 * self._seconds + 0.3 * mean
        return events

    def close(self) -> None:
        """Forget what is under way, and leave the cluster."""
        for reference in self._sent:
            self._ray.cancel(reference, force=True)
        if self._own:
            self._ray.shutdown()
