"""A slice of the withheld benchmark: the diagnosis on data that the bank's formulas did not make.

No case must come out right by itself; counted together they must, as the whole benchmark counts them.
"""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.withheld_data.axes import RIGHT_AXES
from benchmarks.withheld_data.case import draw_case, write_case
from benchmarks.withheld_score.plan import slice_cases
from depthsim.gap import Diagnosis, diagnose
from depthsim.sensor.effect import effect_ids

DEAR = {"material_noise", "disparity_noise", "lens_distortion", "time_offset", "extrinsic_rotation", "max_range",
        "spatial_correlation", "baseline_scale", "fill_rate", "incidence_noise", "invalid_band"}  # fmt: skip
"""Alone they are in the benchmark only: here the others, and the pairs, have their kinds and axes."""
CASES = [case for case in slice_cases() if not (case.tier == "a" and set(case.effects) <= DEAR)]
RIVALS = {"material_noise", "disparity_noise", "fill_rate", "thermal_drift", "vignetting_noise", "heavy_tails"}
"""A fifth of the bank, beside what is true: the whole bank takes a minute a case."""


def validated(number: int, folder: Path) -> tuple[dict, Diagnosis]:
    wanted = replace(CASES[number], frames=12, size=(160, 90))
    write_case(draw_case(wanted), folder)
    truth = json.loads((folder / "case.json").read_text())
    bank = (RIVALS | {effect["effect"] for effect in truth["effects"]}) - set(truth.get("without") or ())
    without = tuple(name for name in effect_ids() if name not in bank)
    found = diagnose(folder / "run", sensor=folder / "sensor.yaml", without=without, threads=1)
    return truth, found


@pytest.mark.parametrize("number", range(len(CASES)), ids=[f"{c.tier}-{'+'.join(c.effects)}" for c in CASES])
def test_case(number: int, tmp_path: Path) -> None:
    truth, found = validated(number, tmp_path)
    true = {effect["effect"] for effect in truth["effects"]}
    named = [cause.effect for cause in found.causes]
    tied = {name for cause in found.causes for name in cause.indistinguishable_from}
    off = any(abs(value) > 0 for value in (truth.get("m_offsets") or {}).values())
    assert found.gap.floor >= 0
    match truth["tier"]:
        case "a":
            assert found.verdict in ("explained", "partly_explained")
            assert true & ({named[0]} | tied | (set(named[1:2]) if off else set())), (named, found.gap)
            assert found.gap.closed_fraction > 0.15
            assert found.gap.after < found.gap.before
        case "b":
            axes = {axis for cut in (found.where + (found.unexplained.where if found.unexplained else ()))
                    for axis in cut.axis.split(" x ")}  # fmt: skip
            assert found.verdict in ("unexplained", "partly_explained")
            right = set(truth["right_axes"]) | {a for e in true for a in RIGHT_AXES.get(e, ())}
            assert axes & right
        case "c":
            assert true & set(named)
        case "d":
            # With m a little off there is a gap, which another law of the noise may explain as well.
            assert set(named) <= ({"material_noise", "disparity_noise"} if off else set())
            assert off or found.verdict == "no_gap"
