"""Runs cases side by side, one result file a case; what is there already is not done again."""

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from benchmarks.withheld_data.case import Wanted
from depthsim.sensor.effect import effect_ids

ROOT = Path(__file__).resolve().parents[2]
D435 = ROOT.parent / "shared" / "data" / "d435_floor"
FOREVER = 3600


@dataclass(frozen=True)
class Settings:
    """How cases are run. folder: of the results. keep: leave runs and reports on disk. alone: of several effects
    diagnose each that is not named by itself, too. own: look for a case's own effects, and no others. vary: thresholds.
    """

    folder: Path
    jobs: int = 1
    keep: bool = False
    rivals: bool = True
    remeasure: bool = True
    apart: bool = True
    alone: bool = True
    own: bool = False
    vary: tuple[str, ...] = ()


def run_cases(cases: Iterable[Wanted], settings: Settings, told: Callable[[dict[str, Any]], None]) -> None:
    """Run each case, or read its result; ``told`` gets every result as it comes."""
    with ThreadPoolExecutor(settings.jobs) as pool:
        for done in as_completed([pool.submit(_one, wanted, settings) for wanted in cases]):
            told(done.result())


def run_d435(settings: Settings) -> dict[str, Any] | None:
    """Tier f: the real D435 frames against ``paper``; None where they are not on this machine."""
    if not D435.is_dir():
        return None
    result = settings.folder / "cases" / "f_d435_floor.json"
    if (there := _there(result, settings)) is not None:
        return there
    profile = ROOT / "depthsim" / "sensor" / "profiles" / "paper.yaml"
    record = {"truth": {"name": "f_d435_floor", "tier": "f", "effects": [], "against": "paper", "m_offsets": {}}}
    record = _judged(record, D435, profile, None, (), settings)
    _store(settings, "f_d435_floor", record)
    return record


def _one(wanted: Wanted, settings: Settings) -> dict[str, Any]:
    result = settings.folder / "cases" / f"{wanted.name}.json"
    if (there := _there(result, settings)) is not None:
        return there
    folder = settings.folder / "work" / wanted.name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    fresh = settings.remeasure and wanted.tier == "a"
    alone = settings.alone and wanted.tier == "c"
    what = {"wanted": asdict(wanted), "folder": str(folder), "fresh": fresh, "alone": alone}
    made = _child({"job": "make", **what}, folder)
    record: dict[str, Any] = {"wanted": asdict(wanted)}
    if "error" in made or "not_seen" in made["answer"]:
        record |= {"error": made.get("error") or made["answer"]["not_seen"], "stage": "make"}
        _store(settings, wanted.name, record)
        return record
    record["truth"] = made["answer"]
    without = tuple(made["answer"].get("without", ()))
    if settings.own:
        true = {effect["effect"] for effect in record["truth"]["effects"]}
        without = tuple(name for name in effect_ids() if name not in true)
    again = folder / "fresh" if fresh else None
    record = _judged(record, folder / "run", folder / "sensor.yaml", again, without, settings)
    if alone and "diagnosis" in record:  # what failed is done again, all of it
        named = {cause["effect"] for cause in record["diagnosis"]["causes"]}
        record["alone"] = _each_found(record, named, folder, settings)
    _store(settings, wanted.name, record)
    if not settings.keep:
        shutil.rmtree(folder)
    return record


def _each_found(record: dict[str, Any], named: set[str], folder: Path, settings: Settings) -> dict[str, list[str]]:
    """What is named where each of the effects is alone, by effect; nothing where that failed.

    What is ``named`` beside the others is found, and takes no diagnosis of its own.
    """
    found = {}
    for number, one in enumerate(record["truth"]["effects"]):
        if one["effect"] in named:
            found[one["effect"]] = [one["effect"]]
            continue
        run = folder / "alone" / str(number)
        order = _order(run, folder / "sensor.yaml", run.with_name(f"report_{number}"), (), settings)
        said = _child({"job": "diagnose", **order}, folder)
        found[one["effect"]] = [cause["effect"] for cause in said.get("answer", {}).get("causes", [])]
    return found


def _order(run: Path, sensor: Path, out: Path, without: tuple[str, ...], settings: Settings) -> dict[str, Any]:
    """What a diagnosis is told."""
    threads = max(1, (os.cpu_count() or 1) // settings.jobs)
    paths = {"run": str(run), "sensor": str(sensor), "out": str(out)}
    return {**paths, "set": list(settings.vary), "without": list(without), "threads": threads}


def _there(file: Path, settings: Settings) -> dict[str, Any] | None:
    """A result that need not be made again: of this bank, by these thresholds, and not the failure of a diagnosis."""
    if not file.exists():
        return None
    record: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    alike = record.get("set", []) == list(settings.vary) and record.get("own", False) == settings.own
    return record if alike and record.get("stage") != "diagnose" else None


def _judged(
    record: dict[str, Any], run: Path, sensor: Path, fresh: Path | None, without: tuple[str, ...], settings: Settings
) -> dict[str, Any]:
    name = record["truth"]["name"]
    work = settings.folder / "work" / name
    work.mkdir(parents=True, exist_ok=True)
    order = _order(run, sensor, work / "report", without, settings)
    found = _child({"job": "diagnose", **order}, work)
    record |= {"seconds": found["seconds"], "peak_mb": found["peak_mb"]}
    record |= {"set": list(settings.vary), "own": settings.own}
    if "error" in found:
        record |= {"error": found["error"], "stage": "diagnose"}
    else:
        record["diagnosis"] = found["answer"]
        if fresh is not None:
            again = _child({"job": "remeasure", **order, "run": str(fresh)}, work)
            record["remeasured"] = again.get("answer") or {"error": again["error"]}
        if settings.apart and found["answer"]["verdict"] == "explained":
            again = _child({"job": "apart", **order}, work)
            record["apart"] = again.get("answer") or {"error": again["error"]}
    if settings.rivals and record["truth"]["tier"] in "ad":
        rivals = _child({"job": "rivals", **order}, work)
        record["rivals"] = rivals.get("answer") or {"error": rivals["error"]}
    return record


def _store(settings: Settings, name: str, record: dict[str, Any]) -> None:
    file = settings.folder / "cases" / f"{name}.json"
    file.parent.mkdir(parents=True, exist_ok=True)
    beside = file.with_suffix(".tmp")
    beside.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    beside.replace(file)


def _child(order: dict[str, Any], work: Path) -> dict[str, Any]:
    """Do a job in a process of its own: its answer or its error, seconds and peak memory."""
    answer, log = work / f"{order['job']}.json", work / f"{order['job']}.log"
    answer.unlink(missing_ok=True)
    command = [sys.executable, "-m", "benchmarks.withheld_score.child", json.dumps({**order, "answer": str(answer)})]
    begin = time.perf_counter()
    with log.open("wb") as text:
        alone = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # as the command has it: more would spin beside other cases
        process = subprocess.Popen(command, cwd=ROOT, env=alone, stdout=text, stderr=subprocess.STDOUT)
        peak = _wait(process, begin + FOREVER)
    outcome: dict[str, Any] = {"seconds": time.perf_counter() - begin, "peak_mb": peak}
    if answer.exists() and process.returncode == 0:
        outcome["answer"] = json.loads(answer.read_text(encoding="utf-8"))
    else:
        lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        outcome["error"] = f"exit {process.returncode}: " + (lines[-1] if lines else "no output")
    return outcome


def _wait(process: subprocess.Popen[bytes], until: float) -> float:
    """Wait for the end; the peak memory [MB] of the process and of those that it waited for."""
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return usage.ru_maxrss / 1024
        if time.perf_counter() > until:
            process.kill()
            until = float("inf")
        time.sleep(0.05)
