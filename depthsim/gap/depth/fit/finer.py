"""A fixed pattern learned once more when the other causes are known, as fine as the frames show it.

While causes are looked for a pattern is a smooth one, as a fine one takes up what is another cause's: the bias of a
filter, or of poses. Beside them only it is left, and then the noise is what does not repeat.
"""

from dataclasses import replace

import numpy as np

from depthsim.gap.depth.fit.fitting import Say
from depthsim.gap.depth.fit.optimize import Model
from depthsim.gap.depth.fit.pattern import learn_fine
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.validate import Validator


def with_fine_pattern(validator: Validator, selection: Selection, say: Say) -> Selection:
    """The causes with a finer pattern, if there is one, and the frames of ``validator`` are not farther from it."""
    evidence, model = validator.evidence, selection.model
    learned = [k for k, part in enumerate(model.parts) if part.fixed.get("grid") is not None]
    if not learned:
        return selection
    number = learned[0]
    say("learning the fixed pattern finely")
    pattern = learn_fine(evidence, model.less(number).build(evidence.base))
    if pattern is None:
        return selection
    values = pattern.effect().model_dump()
    part, xs = model.parts[number], model.split(model.x)
    part = replace(part, fixed={name: values[name] for name in part.fixed}, starts=((values["amplitude"],),))
    xs[number] = part.encode(part.starts[0])
    parts = *model.parts[:number], part, *model.parts[number + 1 :]
    finer = Model(parts, np.concatenate(xs), jacobian=model.jacobian)
    gaps = [validator.quick(one.build(evidence.base), evidence.config.fit.runs) for one in (finer, model)]
    return replace(selection, model=finer) if gaps[0] <= gaps[1] else selection
