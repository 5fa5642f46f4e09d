"""The causes of a gap with what each closes, and the sensor with all of them."""

from collections.abc import Sequence

from depthsim.gap.depth.data.pose_errors import PoseErrors
from depthsim.gap.depth.fit.advice import advice_for
from depthsim.gap.depth.fit.intervals import parameter_intervals
from depthsim.gap.depth.fit.select import Selection
from depthsim.gap.depth.fit.shapley import credit_and_error
from depthsim.gap.depth.fit.validate import Validator
from depthsim.gap.diagnosis import Cause, rounded
from depthsim.sensor.effect import Effect
from depthsim.sensor.profile import Profile


def causes_of(
    validator: Validator,
    selection: Selection,
    whole: float,
    given: Validator | None = None,
    errors: PoseErrors | None = None,
) -> tuple[Cause, ...]:
    """The causes, the one that closes most first. whole: the gap over the floor of the sensor with all of them.

    Causes overlap: the mean over all orders adds up to what they close together, taking one away does not.
    given, errors: where the poses are a cause, the frames as recorded, and what registering them found.
    """
    model, evidence = selection.model, validator.evidence
    if not model.parts and given is None:
        return ()
    intervals = parameter_intervals(evidence, validator.ruler, evidence.base, model)
    shares, halves = credit_and_error(validator, evidence.base, model, given)
    causes = []
    for number, part in enumerate(model.parts):
        fraction = shares[number] / whole if whole > 0 else 0.0
        ties = selection.ties.get(part.effect, ())
        causes.append(
            Cause(
                effect=part.effect,
                parameters=rounded(model.parameters(number), 6),
                ci95=intervals[number],
                closed_fraction=fraction,
                ci95_closed=(fraction - halves[number], fraction + halves[number]),
                indistinguishable_from=ties,
                advice=advice_for(part.effect, ties),
            )
        )
    if given is not None and errors is not None:
        fraction = shares[-1] / whole if whole > 0 else 0.0
        effect = errors.effect()
        causes.append(
            Cause(
                effect=effect.id,
                parameters=rounded(effect.model_dump(), 6),
                ci95={name: rounded(list(ends), 6) for name, ends in errors.intervals().items()},
                closed_fraction=fraction,
                ci95_closed=(fraction - halves[-1], fraction + halves[-1]),
            )
        )
    return tuple(sorted(causes, key=lambda cause: -cause.closed_fraction))


def fixed_profile(profile: Profile, effects: Sequence[Effect]) -> Profile:
    """The profile with the causes added, its parameters as they are reported."""
    shown = tuple(type(e)(**rounded(e.model_dump(), 6)) for e in effects)
    return profile.model_copy(update={"name": f"{profile.name}_fitted", "effects": shown, "camera": None})
