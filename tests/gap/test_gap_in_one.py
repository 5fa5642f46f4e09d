"""A pattern and the biases beside it as one."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from depthsim.gap.config import DepthConfig
from depthsim.gap.depth.fit import in_one as module
from depthsim.gap.depth.fit.candidates import Candidate
from depthsim.gap.depth.fit.fitting import Trial
from depthsim.gap.depth.fit.in_one import in_one
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.search import Search

WHOLE = Candidate("fixed_pattern", (), {}, ((),), in_place=True)


@pytest.mark.parametrize(
    ("named", "alone", "worse", "becomes"),
    [
        (["fixed_pattern", "disparity_offset", "lateral_noise"], 0.105, False, ["lateral_noise", "fixed_pattern"]),
        (["fixed_pattern", "disparity_offset"], 0.105, False, ["fixed_pattern"]),
        (["fixed_pattern", "disparity_offset"], 0.2, False, None),  # what the mount turns is not at the same pixels
        (["fixed_pattern", "disparity_offset"], 0.105, True, None),
        (["fixed_pattern", "lateral_noise"], 0.0, False, None),  # nothing to be in it
        (["disparity_offset", "extrinsic_rotation"], 0.0, False, None),
        (["ambient_light", "disparity_offset", "extrinsic_rotation"], 0.0, False, None),  # its other form is for light
    ],
)
def test_a_pattern_has_what_lies_at_the_same_pixels(
    monkeypatch: pytest.MonkeyPatch, named: list[str], alone: float, worse: bool, becomes: list[str] | None
) -> None:
    monkeypatch.setattr(Model, "build", lambda model, base: ())
    monkeypatch.setattr(module, "surely_worse", lambda *_: worse)
    smooth = replace(WHOLE, in_place=False)
    search = SimpleNamespace(
        config=DepthConfig(),
        whole=1.0,
        base=(),
        validator=None,
        bank=[smooth, WHOLE, replace(WHOLE, effect="ambient_light")],
        begin=lambda one, base: Model((one,), np.empty(0)),
        fit=lambda of, rounds: of,
        validated=lambda of: Trial(of, alone),
        say=lambda text: None,
    )
    model = Model(
        tuple(smooth if one == "fixed_pattern" else replace(smooth, effect=one) for one in named), np.empty(0)
    )
    found = in_one(cast("Search", search), model, 0.1)
    if becomes is None:
        assert found is model
    else:
        assert [part.effect for part in found.parts] == becomes and found.parts[-1] is WHOLE
