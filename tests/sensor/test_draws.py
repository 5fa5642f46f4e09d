"""Philox against its published answers, the distributions, their independence, and the polynomials' accuracy."""

import hashlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numpy.typing import NDArray
from scipy import special, stats

from depthsim import draws
from depthsim.draws import BLOCK, STEPS, Draws, Seed
from depthsim.sensor.effects import material_noise

WORDS = 2**32


def philox(counter: tuple[int, ...], key: tuple[int, ...]) -> list[int]:
    """Philox4x32-10 as Salmon et al. 2011 write it down, in plain integers."""
    (c0, c1, c2, c3), (k0, k1) = counter, key
    for _ in range(10):
        high0, low0 = divmod(0xD2511F53 * c0, WORDS)
        high1, low1 = divmod(0xCD9E8D57 * c2, WORDS)
        c0, c1, c2, c3 = high1 ^ c1 ^ k0, low1, high0 ^ c3 ^ k1, low0
        k0, k1 = (k0 + 0x9E3779B9) % WORDS, (k1 + 0xBB67AE85) % WORDS
    return [c0, c1, c2, c3]


def hexadecimal(text: str) -> tuple[int, ...]:
    return tuple(int(word, 16) for word in text.split())


@pytest.mark.parametrize(
    ("counter", "key", "answer"),  # from kat_vectors of Random123
    [
        ("0 0 0 0", "0 0", "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        ("ffffffff ffffffff ffffffff ffffffff", "ffffffff ffffffff", "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        ("243f6a88 85a308d3 13198a2e 03707344", "a4093822 299f31d0", "d16cfe09 94fdcceb 5001e420 24126ea1"),
    ],
)
def test_the_reference_gives_the_published_answers(counter: str, key: str, answer: str) -> None:
    assert philox(hexadecimal(counter), hexadecimal(key)) == list(hexadecimal(answer))


@settings(max_examples=25)
@given(
    st.integers(0, WORDS // STEPS - 1),
    st.integers(0, WORDS - 1),
    st.integers(0, WORDS - 1),
    st.tuples(st.integers(0, WORDS - 1), st.integers(0, WORDS - 1)),
)
def test_the_kernel_gives_what_the_reference_gives(block: int, frame: int, stream: int, key: tuple[int, int]) -> None:
    words = np.empty(BLOCK, np.uint32)
    draws._philox_block(block, frame, stream, np.array(key, np.uint32), words)
    for step in (0, 1, 17, STEPS - 1):
        assert words[step::STEPS].tolist() == philox((block * STEPS + step, frame, stream, 0), key)


def test_a_known_answer_from_the_kernel() -> None:
    words = np.empty(BLOCK, np.uint32)
    draws._philox_block(0, 0, 0, np.zeros(2, np.uint32), words)
    assert words[::STEPS].tolist() == list(hexadecimal("6627e8d5 e169c58d bc57ac4c 9b00dbd8"))


def test_the_key_is_a_digest_of_seed_and_name_and_the_counter_is_pixel_frame_and_stream() -> None:
    one = Draws(-7, "fill_rate", 3)
    key = hashlib.blake2b(b"-7:fill_rate", digest_size=8).digest()
    assert one.key.tolist() == [int.from_bytes(key[:4], "little"), int.from_bytes(key[4:], "little")]
    numbers = one.uniform((1000,), stream=5)
    for pixel in (0, 63, 64, 255, 256, 999):
        block, place = divmod(pixel, BLOCK)
        word = philox((block * STEPS + place % STEPS, 3, 5, 0), tuple(one.key.tolist()))[place // STEPS]
        assert numbers[pixel] == np.float32(((word >> 9) + 0.5) / 2**23)


def test_normal_numbers_have_the_same_bits_on_every_machine_and_in_every_version() -> None:
    numbers = Draws(7, "material_noise", 3).normal((256,))
    assert [hex(n) for n in numbers.view(np.uint32)[[0, 100, 128, 255]]] == [
        "0x3db0ea5a",
        "0xbe0a8575",
        "0x3f0196bb",
        "0xc0227375",
    ]


@pytest.fixture(scope="module")
def normals() -> NDArray[np.float32]:
    """Ten million normal numbers of five frames."""
    return np.stack([Draws(1, "material_noise", frame, 2).normal((2_000_000,)) for frame in range(5)])


def test_normal_numbers_are_normal(normals: NDArray[np.float32]) -> None:
    assert stats.kstest(normals[0], "norm").pvalue > 1e-3
    z, n = normals.astype(np.float64).ravel(), normals.size
    # The sampling variance of the k-th moment is (μ_2k - μ_k²) / n.
    for power, moment, variance in [(1, 0, 1), (2, 1, 2), (3, 0, 15), (4, 3, 96)]:
        assert abs((z**power).mean() - moment) < 4 * np.sqrt(variance / n), power


@pytest.mark.parametrize("sigma", [2.0, 3.0, 4.0, 5.0])
def test_tails_have_the_right_weight(normals: NDArray[np.float32], sigma: float) -> None:
    for found in (np.count_nonzero(normals > sigma), np.count_nonzero(normals < -sigma)):
        expected = normals.size * special.ndtr(-sigma)
        assert stats.poisson.cdf(found, expected) > 1e-4
        assert stats.poisson.sf(found - 1, expected) > 1e-4


def test_tails_end_far_out() -> None:
    # Words of zero are the far end of the radius: sqrt(2 · 22.87).
    assert 6.7 < np.sqrt(2 * draws._minus_log(np.uint32(0))) < 6.8
    assert draws._minus_log(np.uint32(WORDS - 1)) == 0


def assert_uncorrelated(a: NDArray[np.float32], b: NDArray[np.float32]) -> None:
    """Neither numbers nor squares (a pair of Box and Muller's shares its radius), nor the ones with the others."""
    a, b = a.astype(np.float64), b.astype(np.float64)
    for x, y in ((a, b), (a * a - 1, b * b - 1), (a, b * b - 1), (a * a - 1, b)):
        assert abs((x * y).sum()) < 4.5 * np.sqrt((x * x).mean() * (y * y).mean() * x.size)


@pytest.mark.parametrize("lag", [1, 2, 4, 63, 64, 65, 127, 128, 129, 192, 256, 424, 848, 1280])
def test_neighbours_are_independent(normals: NDArray[np.float32], lag: int) -> None:
    for frame in normals[:2]:
        assert_uncorrelated(frame[:-lag], frame[lag:])


@pytest.mark.parametrize(
    "other",
    [
        Draws(1, "material_noise", 1),
        Draws(1, "material_noise", 2**31),
        Draws(1, "fill_rate", 0),
        Draws(1, "material_noise#2", 0),
        Draws(2, "material_noise", 0),
        Draws(-1, "material_noise", 0),
    ],
    ids=["frame", "far frame", "effect", "second of its kind", "seed", "negative seed"],
)
def test_frames_effects_and_seeds_are_independent(normals: NDArray[np.float32], other: Draws) -> None:
    numbers = other.normal((500_000,))
    assert_uncorrelated(normals[0][:500_000], numbers)
    assert np.mean(normals[0][:500_000] == numbers) < 1e-4


def test_streams_are_independent() -> None:
    one = Draws(1, "lateral_noise", 5)
    first, second = one.normal((500_000,)), one.normal((500_000,), stream=1)
    assert_uncorrelated(first, second)
    # A stream of uniform numbers is of the same words, so an effect gives each use a stream of its own.
    assert_uncorrelated(first, stats.norm.ppf(one.uniform((500_000,), stream=2)).astype(np.float32))


def test_uniform_numbers_are_uniform() -> None:
    u = Draws(3, "fill_rate", 1, 2).uniform((4_000_000,))
    assert u.min() > 0 and u.max() < 1
    assert stats.kstest(u[:2_000_000], "uniform").pvalue > 1e-3
    assert abs(u.mean(dtype=np.float64) - 0.5) < 4 * np.sqrt(1 / 12 / u.size)
    for lag in (1, 64, 128, 192, 256, 848):
        correlation = np.corrcoef(u[:-lag], u[lag:])[0, 1]
        assert abs(correlation) * np.sqrt(u.size) < 4.5


@pytest.mark.parametrize("word", [0, 1, 255, 256, 511, 512, 2**23, 2**31 - 1, 2**31, WORDS - 512, WORDS - 2, WORDS - 1])
def test_the_uniform_never_reaches_its_ends(word: int) -> None:
    u = np.float32(draws._uniform(np.uint32(word)))
    assert 0 < u < 1
    assert abs(float(u) - (word + 0.5) / WORDS) <= 2**-24


@njit
def each(function, numbers, out):
    for i in range(numbers.size):
        out[i] = function(numbers[i])


def all_over(count: int) -> NDArray[np.uint32]:
    """Words at both ends, evenly spread, and evenly spread in their logarithm."""
    ends = np.arange(5000)
    spread = np.linspace(0, WORDS - 1, count).astype(np.int64)
    logarithmic = np.minimum(2.0 ** np.linspace(0, 32, count), WORDS - 1).astype(np.int64)
    return np.unique(np.concatenate([ends, WORDS - 1 - ends, spread, logarithmic])).astype(np.uint32)


def test_the_logarithm() -> None:
    words = all_over(300_000)
    out = np.empty(words.size, np.float32)
    each(draws._minus_log, words, out)
    truth = -np.log(((words >> np.uint32(1)).astype(np.float64) + 0.25) / 2**31)
    assert (np.abs(out - truth) < 2e-7 + 2e-7 * truth).all()
    assert (out >= 0).all()


def test_cosine_and_sine() -> None:
    words = all_over(300_000)
    pairs = np.empty((words.size, 2), np.float32)
    each(draws._cosine_sine, words, pairs)
    angle = 2 * np.pi * words.astype(np.float64) / WORDS - np.pi / 4
    assert np.abs(pairs - np.stack([np.cos(angle), np.sin(angle)], axis=1)).max() < 5e-7


def test_the_exponential() -> None:
    x = np.linspace(0, 80, 400_001).astype(np.float32)
    out = np.empty(x.size, np.float32)
    each(material_noise._exp, x, out)
    error = np.abs(out / np.exp(x.astype(np.float64)) - 1)
    assert error.max() < 5e-6
    assert error[x < 10].max() < 1e-6
    assert out[0] == 1


@settings(max_examples=25)
@given(st.integers(0, 3000), st.integers(1, 9), st.integers(0, 2**40))
def test_threads_and_shapes_make_no_difference(size: int, threads: int, seed: int) -> None:
    one = Draws(seed, "x", 2, 1)
    for kind in ("normal", "uniform"):
        whole = getattr(one, kind)((3000,))
        assert np.array_equal(getattr(Draws(seed, "x", 2, threads), kind)((size,)), whole[:size])
    assert np.array_equal(one.normal((30, 100)).ravel(), one.normal((3000,)))


@given(st.integers(), st.text(st.characters(codec="ascii", min_codepoint=32), min_size=1, max_size=16), st.integers(0))
def test_no_seed_of_a_user_is_one_that_has_a_purpose(user: int, purpose: str, number: int) -> None:
    own = Draws(user, "noise", 0).key
    digest = hashlib.blake2b(f"{user}:noise".encode(), digest_size=8).digest()
    assert own.tolist() == np.frombuffer(digest, "<u4").tolist()
    for other in (Seed(purpose, number), Seed(purpose, user), Seed(purpose)):
        assert Draws(other, "noise", 0).key.tolist() != own.tolist()
    assert (
        Draws(Seed(purpose, number), "noise", 0).key.tolist()
        != Draws(Seed(purpose, number + 1), "noise", 0).key.tolist()
    )
