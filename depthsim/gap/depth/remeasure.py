"""A check of a diagnosis' closed fraction, by random numbers of its own."""

from pathlib import Path

from depthsim.draws import Seed
from depthsim.gap.depth.data.load import load_evidence
from depthsim.gap.depth.fit.validate import Validator
from depthsim.runs.folder import Run
from depthsim.scene import Scene
from depthsim.sensor.profile import Profile, load_profile


def remeasure(
    run: str | Path | Run,
    before: str | Path | Profile,
    after: str | Path | Profile,
    *,
    scene: str | Path | Scene | None = None,
    seed: int = 0,
) -> tuple[float, float, float]:
    """The gap of two profiles against a recording, and the floor of the second, on all blocks [bits per pixel]."""
    evidence, first = load_evidence(run, scene, before)
    second = load_profile(after)
    validator = Validator(evidence, range(len(evidence.blocks)))
    real = validator.real.sum(axis=0)
    seeds = (Seed("remeasuring", 3 * seed + k) for k in range(3))
    profiles = (first, second, second)
    runs = [validator.simulate(p.effects, s).sum(axis=0) for p, s in zip(profiles, seeds, strict=True)]
    gaps = [validator.ruler.gap(real, one) for one in runs]
    return gaps[0], gaps[1], validator.ruler.gap(runs[1], runs[2])
