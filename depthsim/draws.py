"""Counter-based random numbers: every draw is a pure function of run seed, effect, frame and pixel.

So a frame is the same bits whatever the number of threads and whichever frames were made before, and an effect that
is added leaves the draws of the others as they were. The generator is Philox4x32-10 (Salmon, Moraes, Dror and Shaw,
"Parallel random numbers: as easy as 1, 2, 3", SC 2011); normal numbers are made by Box and Muller's method, with
logarithm and cosine as polynomials so that the bits do not depend on a machine's maths library.

The kernels work in blocks of 256 numbers: Philox gives four words a step, so that 64 steps side by side fill a block.
"""

import hashlib
from copy import copy
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from depthsim.kernels import inlined, kernel
from depthsim.llvm import bits_float, float_bits
from depthsim.parallel import split
from depthsim.scratch import Scratch

STEPS = 64
BLOCK = 4 * STEPS

_MULTIPLY_0, _MULTIPLY_1 = np.uint64(0xD2511F53), np.uint64(0xCD9E8D57)
_WEYL_0, _WEYL_1 = np.uint32(0x9E3779B9), np.uint32(0xBB67AE85)
_32 = np.uint64(32)
_f = np.float32


@kernel
def _philox_block(block, frame, stream, key, words):
    """Words 0 to 255 of block ``block``: step i of the 64 gives words i, 64 + i, 128 + i and 192 + i.

    key: (2,) uint32. words: (256,) uint32, written.
    """
    key0, key1 = key[0], key[1]
    for i in range(STEPS):
        c0, c1 = np.uint32(block * STEPS + i), np.uint32(frame)
        c2, c3 = np.uint32(stream), np.uint32(0)
        k0, k1 = key0, key1
        for _ in range(10):
            p0, p1 = _MULTIPLY_0 * np.uint64(c0), _MULTIPLY_1 * np.uint64(c2)
            c0, c2 = np.uint32(p1 >> _32) ^ c1 ^ k0, np.uint32(p0 >> _32) ^ c3 ^ k1
            c1, c3 = np.uint32(p1), np.uint32(p0)
            k0, k1 = np.uint32(k0 + _WEYL_0), np.uint32(k1 + _WEYL_1)
        words[i] = c0
        words[STEPS + i] = c1
        words[2 * STEPS + i] = c2
        words[3 * STEPS + i] = c3


@inlined
def _uniform(word):
    """A word as float32 in (0, 1): the upper 23 bits and half a step, which float32 holds exactly."""
    return (_f(np.int32(word >> np.uint32(9))) + _f(0.5)) * _f(2.0**-23)


@inlined
def _minus_log(word):
    """-ln((w + 1/4) / 2^31), w the upper 31 bits of the word: 0 to 22.9, error below 2e-7 or 2e-7 of the value."""
    # The shift keeps the conversion within int32, which every machine has an instruction for.
    x = _f(np.int32(word >> np.uint32(1))) + _f(0.25)
    bits = float_bits(x)
    # Write x = 2^e (1 + t) with 1 + t between 0.7 and 1.41.
    e = (bits - np.int32(0x3F3504F3)) >> np.int32(23)
    t = bits_float(np.int32(bits - (e << np.int32(23)))) - _f(1)
    s = t / (_f(2) + t)
    z = s * s
    # ln(1 + t) = 2 atanh(t / (2 + t)).
    series = _f(2) * s * (_f(1) + z * (_f(1 / 3) + z * (_f(1 / 5) + z * (_f(1 / 7) + z * _f(1 / 9)))))
    return (_f(31) - _f(e)) * _f(0.6931471805599453) - series


@inlined
def _cosine_sine(word):
    """cos and sin of 2π·word/2^32 - π/4 by their series on an eighth of the circle, error below 5e-7."""
    quarter = np.int32(word >> np.uint32(30))
    # The angle from the middle of the quarter, -π/4 to π/4.
    a = _f(np.int32((word << np.uint32(2)) ^ np.uint32(0x80000000))) * _f(np.pi / 4 * 2.0**-31)
    z = a * a
    c = _f(1) + z * (_f(-1 / 2) + z * (_f(1 / 24) + z * (_f(-1 / 720) + z * _f(1 / 40320))))
    s = a * (_f(1) + z * (_f(-1 / 6) + z * (_f(1 / 120) + z * _f(-1 / 5040))))
    # The quarters' middles lie at 45°, 135°, ...; a turn of the whole circle by 45° changes no distribution.
    x = c if quarter & np.int32(1) == np.int32(0) else -s
    y = s if quarter & np.int32(1) == np.int32(0) else c
    sign = _f(1) if quarter < np.int32(2) else _f(-1)
    return x * sign, y * sign


@kernel
def normal_block(block, frame, stream, key, words, normals):  # noqa: ANN201 - numba
    """Standard normal numbers 256·block to 256·block + 255. words: (256,) uint32 scratch. normals: (256,) float32."""
    _philox_block(block, frame, stream, key, words)
    for i in range(2 * STEPS):
        radius = np.sqrt(_f(2) * _minus_log(words[i]))
        c, s = _cosine_sine(words[2 * STEPS + i])
        normals[i] = radius * c
        normals[2 * STEPS + i] = radius * s


@kernel
def uniform_block(block, frame, stream, key, words, uniforms):  # noqa: ANN201 - numba
    """Uniform numbers 256·block to 256·block + 255 in (0, 1). Scratch and result as in :func:`normal_block`."""
    _philox_block(block, frame, stream, key, words)
    for i in range(BLOCK):
        uniforms[i] = _uniform(words[i])


@kernel
def _fill_normal(start, stop, frame, stream, key, out):
    words, values = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        normal_block(at // BLOCK, frame, stream, key, words, values)
        part = out[at : min(at + BLOCK, stop)]
        part[:] = values[: part.size]


@kernel
def _fill_uniform(start, stop, frame, stream, key, out):
    words, values = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        uniform_block(at // BLOCK, frame, stream, key, words, values)
        part = out[at : min(at + BLOCK, stop)]
        part[:] = values[: part.size]


class Seed(NamedTuple):
    """A seed that no user can give: each purpose has a key space of its own, and so have whole numbers, as users give.

    purpose: printable ASCII, 1 to 16 characters, what BLAKE2b takes as its personalization.
    """

    purpose: str
    number: int = 0


class Draws:
    """The random numbers of one effect in one frame.

    ``stream`` distinguishes several pictures of numbers that one effect needs. A kernel that wants to make its numbers
    while it uses them takes ``key`` and ``frame`` and calls :func:`normal_block` or :func:`uniform_block`.
    """

    def __init__(
        self, seed: int | Seed, name: str, frame: int, threads: int = 1, scratch: Scratch | None = None
    ) -> None:
        purpose, number = seed if isinstance(seed, Seed) else ("", seed)
        digest = hashlib.blake2b(f"{number}:{name}".encode(), digest_size=8, person=purpose.encode()).digest()
        self.key = np.frombuffer(digest, "<u4").astype(np.uint32)
        self.frame = frame
        self._threads, self._scratch = threads, scratch

    def of_frame(self, frame: int) -> "Draws":
        """The same effect's numbers in another frame, in memory of their own."""
        other = copy(self)
        other.frame, other._scratch = frame, None
        return other

    def empty(self, shape: tuple[int, ...]) -> NDArray[np.float32]:
        """Float32 numbers to be written; with ``scratch`` they are good until the frame is finished."""
        return np.empty(shape, np.float32) if self._scratch is None else self._scratch.empty(shape)

    def normal(self, shape: tuple[int, ...], stream: int = 0) -> NDArray[np.float32]:
        """Standard normal float32 numbers."""
        out = self.empty(shape)
        split(_fill_normal, out.size, self._threads, self.frame, stream, self.key, out.reshape(-1), multiple=BLOCK)
        return out

    def uniform(self, shape: tuple[int, ...], stream: int = 0) -> NDArray[np.float32]:
        """Uniform float32 numbers in (0, 1)."""
        out = self.empty(shape)
        split(_fill_uniform, out.size, self._threads, self.frame, stream, self.key, out.reshape(-1), multiple=BLOCK)
        return out
