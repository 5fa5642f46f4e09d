"""The thresholds: all of them documented, and each varied from outside."""

from pathlib import Path

import pytest
from reports import LACKED, recorded

from benchmarks import nulls, withheld, withheld_flight
from depthsim.errors import InputError
from depthsim.gap import diagnose
from depthsim.gap.config import DepthConfig, FlightConfig
from docs.thresholds import page

DOCS = Path(__file__).parents[2] / "docs"
BANK = {"incidence_noise", "fill_rate"}


def test_the_page_of_thresholds_is_the_code() -> None:
    assert (DOCS / "thresholds.md").read_text(encoding="utf-8") == page(), "run docs/thresholds.py"


@pytest.mark.parametrize("config", [DepthConfig, FlightConfig])
def test_any_threshold_is_varied_by_its_name(config: type[DepthConfig] | type[FlightConfig]) -> None:
    defaults = config()
    for name, section in defaults:
        for key, value in section:
            varied = config.varied([f"{name}.{key}={value + 1}"])
            assert getattr(getattr(varied, name), key) == value + 1
            assert varied != defaults
    assert config.varied([]) == defaults


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("most_causes=2", "config: most_causes=2: is no SECTION.NAME=VALUE"),
        ("select.most_causes", "config: select.most_causes: is no SECTION.NAME=VALUE"),
        ("select.causes=2", "config: select.causes: Extra inputs are not permitted"),
        ("choose.most_causes=2", "config: choose: Extra inputs are not permitted"),
        ("select.most_causes=two", "config: select.most_causes: Input should be a valid integer"),
        ("select.most_causes=0", "config: select.most_causes: Input should be greater than or equal to 1"),
        ("select.tied=nan", "config: select.tied: Input should be"),
    ],
)
def test_a_setting_that_is_none_is_refused(setting: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        DepthConfig.varied([setting])
    assert str(caught.value).startswith(said)


def test_a_diagnosis_goes_by_the_thresholds_that_it_is_given() -> None:
    from depthsim.sensor.effect import effect_ids

    run, without = recorded(LACKED), [name for name in effect_ids() if name not in BANK]
    found = diagnose(run, sensor="paper", without=without, threads=1)
    assert found.verdict == "explained" and not any("budget" in note for note in found.notes)
    brief = diagnose(run, sensor="paper", without=without, threads=1, config=DepthConfig.varied(["fit.most_work=1"]))
    assert brief.verdict == "unexplained" and any("the search ended at its budget" in note for note in brief.notes)
    deaf = DepthConfig.varied(["significance.excess=1e6", "significance.excess_along_axis=1e6"])
    assert diagnose(run, sensor="paper", without=without, threads=1, config=deaf).verdict == "no_gap"
    strict = DepthConfig.varied(["select.first=1.5", "select.first_apart=1.5"])
    assert diagnose(run, sensor="paper", without=without, threads=1, config=strict).verdict == "unexplained"


def test_every_benchmark_of_a_diagnosis_varies_its_thresholds() -> None:
    assert nulls.main.__annotations__["vary"] and withheld.run.__annotations__["vary"]
    assert withheld_flight.parser().parse_args(["--set", "select.most_causes=2"]).vary == ["select.most_causes=2"]
