"""The parts of the diagnosis: noise, lags and delays, blocks of time, the page."""

import numpy as np
import pytest

from depthsim.flight.fit.motion import CUTOFF, low_pass
from depthsim.flight.ground_effect import GroundEffect, ground_factor
from depthsim.flight.measurement import Measurement, lagged, shifted, turned
from depthsim.gap.flight.data.noise import noise_levels
from depthsim.gap.report.page import Bar, Page
from depthsim.gap.resampling import block_weights, contiguous, paired, percentile95

RATE = 100.0


@pytest.mark.parametrize(("kind", "off"), [("white", 0.04), ("differentiated", 0.15)])
def test_noise_is_distinguished_from_slow_forces(kind: str, off: float) -> None:
    rng = np.random.default_rng(2)
    found, truth = [], []
    for _ in range(12):
        noise = 0.2 * rng.normal(size=(4500, 1))
        if kind == "differentiated":
            noise = np.gradient(0.01 * rng.normal(size=(4500, 1)), 1 / RATE, axis=0)
        slow = np.sin(2 * np.pi * 0.5 * np.arange(4500)[:, None] / RATE)
        found.append(noise_levels(noise + slow, RATE)[0])
        truth.append(low_pass(noise, RATE, CUTOFF).std())
    assert np.mean(found) == pytest.approx(np.mean(truth), rel=off)


def test_a_lag_is_that_of_first_order() -> None:
    t = np.arange(400) / RATE
    frequency = 2.0
    wave = np.sin(2 * np.pi * frequency * t)[:, None]
    lag = 0.05
    out = lagged(wave, lag, 1 / RATE)[200:, 0]
    phase = np.arctan(2 * np.pi * frequency * lag)
    expected = np.cos(phase) * np.sin(2 * np.pi * frequency * t[200:] - phase)
    np.testing.assert_allclose(out, expected, atol=2e-3)
    np.testing.assert_allclose(lagged(np.full((50, 2), 3.0), lag, 0.01), 3.0)
    twice = lagged(lagged(wave, lag / 2, 1 / RATE), lag / 2, 1 / RATE)
    np.testing.assert_allclose(lagged(wave, lag, 1 / RATE, 2), twice)


def test_shifts_and_turns() -> None:
    ramp = np.arange(100.0)[:, None] / RATE
    np.testing.assert_allclose(shifted(ramp, RATE, 0.025)[10:], ramp[10:] - 0.025, atol=1e-12)
    np.testing.assert_allclose(shifted(ramp, RATE, -0.025)[:-10], ramp[:-10] + 0.025, atol=1e-12)
    quarter = turned(np.array([[1.0, 0, 0]]), (0, 0, np.pi / 2))
    np.testing.assert_allclose(quarter, [[0, -1, 0]], atol=1e-12)


def test_a_recorder_that_is_neutral_changes_nothing() -> None:
    rng = np.random.default_rng(0)
    force, thrusts = rng.normal(size=(50, 3)), rng.uniform(1, 2, (50, 4))
    recorder = Measurement.model_validate({})
    assert recorder.of_force(force, 1e-3) is force
    assert recorder.of_thrusts(thrusts, 0.03, 1e-3) is thrusts
    biased = Measurement(imu_bias=(0.1, 0.2, 0.3))
    np.testing.assert_allclose(biased.of_force(force, 1e-3) - force, np.tile([0.1, 0.2, 0.3], (50, 1)))


def test_commands_lead_what_the_motors_make() -> None:
    t = np.arange(3000) * 1e-3
    made = 2 + np.sin(3 * t)[:, None] * np.ones((1, 4))
    command = Measurement(thrust="command").of_thrusts(made, 0.05, 1e-3)
    np.testing.assert_allclose(lagged(command, 0.05, 1e-3)[1000:-10], made[1000:-10], atol=1e-3)


@pytest.mark.parametrize("law", ["cheeseman_bennett", "exponential"])
def test_the_ground_effect_is_the_same_in_the_kernel(law: str) -> None:
    effect = GroundEffect.model_validate({"law": law, "strength": 1.7, "height": 0.2})
    heights = np.array([-1.0, 0.0, 0.05, 0.1, 0.3, 1.0, 50.0])
    kernel = [ground_factor(height, 0.12, *effect.numbers) for height in heights]
    np.testing.assert_allclose(effect.factors(heights, 0.12), kernel)
    assert kernel[-1] == pytest.approx(1, abs=1e-4)


def test_blocks_are_in_order_and_even() -> None:
    parts = contiguous(17, 5)
    assert (np.diff(parts) >= 0).all() and set(parts) == set(range(5))
    assert np.ptp(np.bincount(parts)) <= 1
    assert len(set(contiguous(3, 9))) == 3
    weights = block_weights(20, 300, seed=1)
    assert (weights.sum(axis=1) == 20).all()
    assert (weights == block_weights(20, 300, seed=1)).all() and (weights != block_weights(20, 300, seed=2)).any()
    assert percentile95(np.arange(1001.0)) == pytest.approx((25, 975))


def test_pairs_see_what_is_common_to_all_blocks() -> None:
    rng = np.random.default_rng(3)
    common = rng.normal(size=40) * 10
    assert paired(common + 0.5 + 0.1 * rng.normal(size=40), common).t > 10
    assert abs(paired(common + rng.normal(size=40), common).t) < 3.5


def test_the_page_is_escaped_and_whole() -> None:
    page = Page("a <b>", "one & two").tiles([("3 %", "of <it>")])
    page.section("S").text("x < y").callout("careful", "bad").items(["i & j"]).items([])
    page.table(["name", "share"], [["r<1>", Bar(0.5)], ["s", Bar(1.7, "all")]], numbers=[0])
    page.picture(b"\x89PNG", 'say "so"', width=300).code("a && b")
    text = page.html()
    for piece in (
        "a &lt;b&gt;",
        "one &amp; two",
        "of &lt;it&gt;",
        "x &lt; y",
        "i &amp; j",
        "r&lt;1&gt;",
        "a &amp;&amp; b",
    ):
        assert piece in text
    assert "width:50.0%" in text and "width:100.0%" in text and "say &quot;so&quot;" in text
    assert text.count("<section>") == text.count("</section>") == 1
    assert "http" not in text and "<script" not in text and "url(" not in text
    assert page.html() == text
