"""A lock for places that have none: an object that its holder renews, and that others take over when it stands still.

No clock is compared with another: whoever finds a lease watches whether it is renewed, by his own monotonic clock, so
clocks that differ or are set back do no harm.
"""

import json
import os
import socket
import threading
import time
import uuid
from collections.abc import Callable
from pathlib import Path

from depthsim.errors import InputError
from depthsim.runs.storing import LOCK
from depthsim.yamlfile import parse_json

BEAT = 5.0
"""[s] How often a lease is renewed."""
PATIENCE = 4
"""How many beats a lease may stand still before it is taken over."""


class Lease:
    """A lease at ``url``, by the functions that read, create, write and remove an object there.

    beat: [s] how often it is renewed.
    """

    def __init__(
        self,
        url: str,
        read: Callable[[str], bytes | None],
        create: Callable[[str, bytes], bool],
        write: Callable[[str, bytes], None],
        remove: Callable[[str], None],
        beat: float | None = None,
    ) -> None:
        self._url, self._read, self._create, self._write, self._remove = url, read, create, write, remove
        self._token, self._beats = uuid.uuid4().hex, 0
        self._beat = BEAT if beat is None else beat
        self._done, self._lost = threading.Event(), threading.Event()
        self._thread: threading.Thread | None = None

    def acquire(self) -> None:
        """Take the lease. Raises :class:`InputError` where another driver holds it and lives."""
        if not self._create(LOCK, self._text()):
            self._wait_for_death()
            self._write(LOCK, self._text())
        # Of two that write at the same moment one is overwritten; both look again.
        time.sleep(min(0.2, self._beat))
        if not self._is_own():
            raise self._refused("")
        self._thread = threading.Thread(target=self._renew, daemon=True)
        self._thread.start()

    def _wait_for_death(self) -> None:
        """Return when the lease that is there stands still, or when its holder is known to be dead."""
        first = self._read(LOCK)
        if first is None or _is_dead(first):
            return
        until = time.monotonic() + PATIENCE * self._beat
        while time.monotonic() < until:
            time.sleep(min(self._beat / 2, 1.0))
            now = self._read(LOCK)
            if now is None:
                return
            if now != first:
                raise self._refused(_holder(now))

    def _refused(self, holder: str) -> InputError:
        by = f" ({holder})" if holder else ""
        return InputError(self._url, "", f"is being written by another process{by}", "wait for it, or end it")

    def _text(self) -> bytes:
        keys = {"token": self._token, "beat": self._beats, "host": _host(), "pid": os.getpid()}
        return json.dumps(keys).encode()

    def _is_own(self) -> bool:
        there = _parse(self._read(LOCK) or b"")
        return there.get("token") == self._token

    def _renew(self) -> None:
        while not self._done.wait(self._beat):
            try:
                if not self._is_own():
                    self._lost.set()
                    return
                self._beats += 1
                self._write(LOCK, self._text())
            except Exception:  # the network is away; whoever needs the lease may take it over
                continue

    def hold(self) -> None:
        """Raise :class:`InputError` if another driver has taken the lease over."""
        if self._lost.is_set():
            raise InputError(self._url, "", "was taken over by another driver", "let that one finish")

    def release(self) -> None:
        """Let go."""
        self._done.set()
        if self._thread is not None:
            self._thread.join(timeout=60)
        if not self._lost.is_set() and self._is_own():
            self._remove(LOCK)


def _parse(data: bytes) -> dict[str, object]:
    try:
        value = parse_json(data)
    except ValueError:
        return {}
    return value if isinstance(value, dict) else {}


def _holder(data: bytes) -> str:
    keys = _parse(data)
    return f"process {keys.get('pid')} of {str(keys.get('host')).partition('/')[0]}"


def _host() -> str:
    """This machine since it was started, and the name space of its process numbers: containers have their own."""
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii").strip()
        space = os.readlink("/proc/self/ns/pid")
    except OSError:
        boot, space = str(uuid.getnode()), ""
    return f"{socket.gethostname()}/{boot}/{space}"


def _is_dead(data: bytes) -> bool:
    """Whether the holder was a process of this very machine that is there no more."""
    keys = _parse(data)
    pid = keys.get("pid")
    if keys.get("host") != _host() or not isinstance(pid, int):
        return False
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    except PermissionError:
        return False
    return False
