"""A fixed pattern learned once more beside other causes.

The bank's is what all frames have in common, and what other biases have in common is in it: a rolling shutter's, on a
way that hardly turns. While causes are looked for it is a smooth one, as a fine one takes up what is another cause's:
the bias of a filter, or of poses. Beside them only it is left, and then the noise is what does not repeat.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from depthsim.gap.depth.fit.fitting import Say
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.pattern import learn_beside
from depthsim.gap.depth.fit.search import Search
from depthsim.gap.depth.fit.validate import Validator

if TYPE_CHECKING:  # which has its pattern learned beside its biases
    from depthsim.gap.depth.fit.select import Selection


def with_fine_pattern(validator: Validator, selection: "Selection", say: Say) -> "Selection":
    """The causes with a finer pattern, if there is one, and the frames of ``validator`` are not farther from it."""
    evidence, model = validator.evidence, selection.model
    number = _learned(model)
    if number is None:
        return selection
    say("learning the fixed pattern finely")
    if (finer := _again(validator, model, number, fine=True)) is None:
        return selection
    gaps = [validator.quick(one.build(evidence.base), evidence.config.fit.runs) for one in (finer, model)]
    return replace(selection, model=finer) if gaps[0] <= gaps[1] else selection


def with_pattern_beside_biases(search: Search, model: Model) -> Model:
    """The model with a pattern of what its other biases leave, fitted, if the frames held out are nearer to it."""
    number = _learned(model)
    if number is None or all(effect.kinds[0] != "bias" for effect in model.less(number).effects):
        return model
    search.say("learning the fixed pattern beside the other biases")
    if (again := _again(search.validator, model, number, fine=False)) is None:
        return model
    again = search.fit(again, 3)
    return min(again, model, key=lambda one: search.validated(one).gap)


def _learned(model: Model) -> int | None:
    """Which part of a model is learned."""
    return next((k for k, part in enumerate(model.parts) if part.fixed.get("grid") is not None), None)


def _again(validator: Validator, model: Model, number: int, *, fine: bool) -> Model | None:
    """A model with its pattern learned beside the others; None where there is none."""
    evidence = validator.evidence
    pattern = learn_beside(evidence, model.less(number).build(evidence.base), fine=fine)
    if pattern is None:
        return None
    values = pattern.effect().model_dump()
    part, xs = model.parts[number], model.split(model.x)
    part = replace(part, fixed={name: values[name] for name in part.fixed}, starts=((values["amplitude"],),))
    xs[number] = part.encode(part.starts[0])
    parts = *model.parts[:number], part, *model.parts[number + 1 :]
    return Model(parts, np.concatenate(xs), jacobian=model.jacobian)
