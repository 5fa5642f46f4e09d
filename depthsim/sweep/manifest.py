"""What is known of every run: a journal of lines while the sweep is under way, put into Parquet from time to time.

``manifest.parquet`` says what each run is and whether it is whole; the same sweep gives the same file. ``work.parquet``
says who made it and how long that took. Rewriting them for every run would take time that grows as the square of the
runs, so each that is finished is a line of the journal, and the files are written when the journal has grown by a tenth
of the sweep, and at the end.
"""

import hashlib
import io
import json
from collections.abc import Iterator
from typing import Any

from depthsim.errors import InputError
from depthsim.extras import load_extra
from depthsim.sweep.plan import Plan
from depthsim.sweep.target import MANIFEST, SWEEP, WORK, Target
from depthsim.sweep.vary import values_in_use
from depthsim.yamlfile import parse_json

WHOLE, FAILED, MISSING = "whole", "failed", "missing"
_SHARE = 10
_LEAST = 1000
_MANIFEST = {
    "run": "int64", "path": "string", "scene": "string", "trajectory": "string", "profile": "string", "seed": "int64",
    "draw": "int64", "noise_seed": "int64", "values": "string", "state": "string", "frames": "int32", "bytes": "int64",
    "sha256": "string", "error": "string",
}  # fmt: skip
_WORK = {
    "run": "int64",
    "made": "int32",
    "seconds": "float64",
    "attempts": "int32",
    "built": "int32",
    "worker": "string",
}


class Manifest:
    """The state of all runs of a plan in a target. Used by one driver, which holds the target's lock."""

    def __init__(self, target: Target, plan: Plan) -> None:
        self._target, self._plan = target, plan
        self.rows: dict[int, dict[str, Any]] = dict(_read_rows(target, len(plan)))
        self._since = 0
        self._waiting: list[bytes] = []

    def state(self, run: int) -> str:
        """whole, failed or missing."""
        return str(self.rows.get(run, {}).get("state", MISSING))

    def put(self, row: dict[str, Any]) -> None:
        """Take what has become of a run; it is kept once :meth:`flush` has been called."""
        old = self.rows.get(row["run"], {})
        self.rows[row["run"]] = {**old, "error": "", **row}
        if row.get("made") == 0 and old.get("seconds") is not None:  # looked at again: the figures of its making stay
            self.rows[row["run"]] |= {key: old[key] for key in ("made", "seconds", "worker", "attempts") if key in old}
        self._waiting.append(json.dumps(self.rows[row["run"]]).encode() + b"\n")

    @property
    def waits(self) -> bool:
        """Whether there is something to flush."""
        return bool(self._waiting)

    def flush(self) -> None:
        """Write what has come to the journal, and from time to time all to the Parquet files."""
        if self._waiting:
            self._target.append_journal(b"".join(self._waiting))
            self._since += len(self._waiting)
            self._waiting.clear()
        if self._since >= max(_LEAST, len(self._plan) // _SHARE):
            self.compact()

    def compact(self) -> None:
        """Write the Parquet files, whole, and begin a new journal."""
        self._target.write(WORK, self._parquet(_WORK, self._work()))
        self._target.write(MANIFEST, self._parquet(_MANIFEST, self._runs()))
        self._target.clear_journal()
        self._since = 0

    def _runs(self) -> Iterator[dict[str, Any]]:
        plan = self._plan
        for index in range(len(plan)):
            run, row = plan.run(index), self.rows.get(index, {})
            scene = plan.scenes[run.scene]
            yield {
                "run": index,
                "path": run.path,
                "scene": scene.name,
                "trajectory": scene.trajectories[run.trajectory].name,
                "profile": plan.profiles[run.profile].name,
                "seed": run.seed,
                "draw": run.draw,
                "noise_seed": run.noise_seed,
                "values": json.dumps(values_in_use(plan, run), sort_keys=True),
                "state": row.get("state", MISSING),
                "frames": row.get("frames"),
                "bytes": row.get("bytes"),
                "sha256": row.get("sha256"),
                "error": row.get("error") or None,
            }

    def _work(self) -> Iterator[dict[str, Any]]:
        for index in sorted(self.rows):
            yield {key: self.rows[index].get(key) for key in _WORK}

    def _parquet(self, kinds: dict[str, str], rows: Iterator[dict[str, Any]]) -> bytes:
        pyarrow, parquet = load_extra("pyarrow", "sweep"), load_extra("pyarrow.parquet", "sweep")
        plan = self._plan
        columns: dict[str, list[Any]] = {name: [] for name in kinds}
        for row in rows:
            for name, values in columns.items():
                values.append(row[name])
        sources = {scene.name: scene.sources for scene in plan.scenes}
        sources |= {profile.name: profile.sources for profile in plan.profiles}
        digests = {scene.name: scene.digest for scene in plan.scenes}
        facts = {"sweep": plan.name, "depthsim": plan.depthsim, "plan_sha256": plan.digest}
        facts["sweep_sha256"] = hashlib.sha256(self._target.read(SWEEP) or b"").hexdigest()
        facts |= {"sources_sha256": json.dumps(sources), "scene_digests": json.dumps(digests)}
        schema = pyarrow.schema(
            [(name, getattr(pyarrow, kind)()) for name, kind in kinds.items()],
            metadata={f"depthsim.{key}": value for key, value in facts.items()},
        )
        out = io.BytesIO()
        parquet.write_table(pyarrow.table(columns, schema=schema), out, compression="zstd")
        return out.getvalue()


def _read_rows(target: Target, count: int) -> Iterator[tuple[int, dict[str, Any]]]:
    """The rows that a target holds: those of the Parquet files, then those of the journal."""
    pyarrow, parquet = load_extra("pyarrow", "sweep"), load_extra("pyarrow.parquet", "sweep")
    merged: dict[int, dict[str, Any]] = {}
    for name in (MANIFEST, WORK):
        data = target.read(name)
        if data is None:
            continue
        try:
            # On this thread alone: read_table leaves the file to threads that may still hold it as the interpreter
            # ends, which aborts the process (apache/arrow issues 33975 and 34314).
            with parquet.ParquetFile(pyarrow.BufferReader(data), pre_buffer=False) as file:
                table = file.read(use_threads=False).to_pylist()
        except Exception as error:
            problem = f"is damaged ({str(error).splitlines()[0][:100]})"
            fix = "remove it: the same command looks at every run again"
            raise InputError(f"{target.url}/{name}", "", problem, fix) from None
        for row in table:
            merged.setdefault(row["run"], {}).update({key: value for key, value in row.items() if key in _KEPT})
    for line in target.read_journal().splitlines():
        try:
            row = parse_json(line)
            merged[int(row["run"])] = row
        except (ValueError, KeyError, TypeError):
            continue  # half a line, of a disk that was full: its run is looked at again
    yield from ((run, row) for run, row in merged.items() if 0 <= run < count and row.get("state") in (WHOLE, FAILED))


_KEPT = {"run", "state", "frames", "bytes", "sha256", "error", *_WORK}
