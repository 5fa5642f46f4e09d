"""One job in a process of its own, so that its time and memory are its own: reads what to do from its argument.

python -m benchmarks.withheld_score.child '{"job": "diagnose", ...}'
"""

import json
import sys
from pathlib import Path
from typing import Any


def main() -> None:
    """Do the job and write its answer to the file that it names."""
    order: dict[str, Any] = json.loads(sys.argv[1])
    answer = {"make": _make, "diagnose": _diagnose, "remeasure": _remeasure, "rivals": _rivals, "apart": _apart}[
        order["job"]
    ](order)
    Path(order["answer"]).write_text(json.dumps(answer), encoding="utf-8")


def _make(order: dict[str, Any]) -> dict[str, Any]:
    """The case's folder, and beside its run a fresh one for measuring again, or one with each of its effects."""
    from benchmarks.withheld_data.case import (
        CannotBeSeen,
        Wanted,
        draw_case,
        truth,
        write_case,
        write_each_alone,
        write_fresh,
    )

    keys = order["wanted"]
    size = tuple(keys.pop("size")) if keys.get("size") else keys.pop("size", None)
    effects, strengths = tuple(keys.pop("effects")), tuple(keys.pop("strengths"))
    try:
        case = draw_case(Wanted(effects=effects, strengths=strengths, size=size, **keys))
    except CannotBeSeen as error:
        return {"not_seen": str(error)}
    folder = Path(order["folder"])
    write_case(case, folder)
    if order["fresh"]:
        write_fresh(case, folder / "fresh")
    if order["alone"]:
        write_each_alone(case, folder / "alone")
    return truth(case)


def _diagnose(order: dict[str, Any]) -> dict[str, Any]:
    from depthsim.gap import diagnose
    from depthsim.gap.config import DepthConfig

    diagnose(
        Path(order["run"]),
        sensor=Path(order["sensor"]),
        out=Path(order["out"]),
        without=tuple(order["without"]),
        threads=order["threads"],
        config=DepthConfig.varied(order["set"]),
        tasks=order.get("tasks", False),
    )
    return dict(json.loads((Path(order["out"]) / "diagnosis.json").read_text(encoding="utf-8")))


def _remeasure(order: dict[str, Any]) -> dict[str, Any]:
    """The gap before and after by the profile that was written, on frames that nothing was fitted on."""
    from depthsim.gap import remeasure

    before, after, floor = remeasure(
        Path(order["run"]), Path(order["sensor"]), Path(order["out"]) / "sensor.yaml", seed=12345
    )
    share = (before - after) / (before - floor) if before > floor else 0.0
    return {"before": before, "after": after, "floor": floor, "closed_fraction": share}


def _apart(order: dict[str, Any]) -> dict[str, float]:
    """By how much an independent test tells the recording from the simulator that the report wrote."""
    from benchmarks.withheld_score.independent import told_apart

    return told_apart(Path(order["run"]), Path(order["out"]) / "sensor.yaml")


def _rivals(order: dict[str, Any]) -> dict[str, Any]:
    from benchmarks.withheld_score.rivals import by_importance, by_rmse

    run, sensor = Path(order["run"]), Path(order["sensor"])
    return {"rmse": by_rmse(run, sensor), "importance": by_importance(run, sensor)}


if __name__ == "__main__":
    main()
