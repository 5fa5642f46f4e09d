"""Pictures of normal noise that is correlated between neighbouring pixels and between frames.

Both correlations are linear in white noise whose numbers are a function of effect, frame and pixel, so any frame can be
made by itself: nothing is carried on from the frames before it.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from depthsim.draws import BLOCK, Draws, normal_block
from depthsim.kernels import inlined, kernel
from depthsim.parallel import split

_f = np.float32
_FORGOTTEN = 0.01
"""Frames that are correlated by less than this may be drawn independently."""
_REACH = 1.8
"""Where the smoothing weights end, in lengths of half correlation: at three of their standard deviations."""
_WHITE = 0.1
"""The length of half correlation [px] below which noise is white: neighbours are correlated by 2^-100."""
_PERIOD = 512
"""The length of the transform [px], over which the correlation must have died away."""


Fields = dict[tuple[bytes, int, tuple[int, int], "Correlation"], NDArray[np.float32]]
"""Pictures of noise that are kept, by key and frame of their numbers, shape and correlation."""


@dataclass(frozen=True)
class Correlation:
    """How the noise of a frame is correlated.

    x, y: the lag at which the correlation between pixels has fallen to a half, along rows and columns [px]; 0 is none.
    frames: the correlation of a pixel's noise with that of the frame before, 0 to below 1.
    """

    x: float = 0.0
    y: float = 0.0
    frames: float = 0.0


def noise_field(draws: Draws, shape: tuple[int, int], correlation: Correlation, threads: int) -> NDArray[np.float32]:
    """(height, width) float32 normal noise, mean 0 and variance 1 at every pixel, the border included.

    The correlation between pixels is 2^-((dx/x)² + (dy/y)²), between frames ``frames``^|n|, and the product of both.
    """
    across, down = smoothing_weights(correlation.x), smoothing_weights(correlation.y)
    height, width = shape
    wide = height + down.size - 1, width + across.size - 1
    numbers, weights = frame_weights(draws.frame, correlation.frames)
    white = draws.empty(wide)
    split(_sum_frames, white.size, threads, numbers, weights, draws.key, white.reshape(-1), multiple=BLOCK)
    if wide == shape:
        return white
    smooth = draws.empty(shape)
    split(_smooth, height, threads, across, down, white, smooth)
    return smooth


@lru_cache(maxsize=64)
def smoothing_weights(half: float) -> NDArray[np.float32]:
    """Weights that give white noise variance 1 and the correlation 2^-(lag / half)², ``half`` and lag in px.

    Smoothing multiplies the spectrum by that of the weights, squared. So the weights' is the root of that of the
    correlation, and they are nearly a Gaussian: exactly so for a large ``half``, where whole pixels do not matter.
    """
    reach = int(np.ceil(_REACH * half)) + 2 if half > _WHITE else 0
    lags = np.fft.ifftshift(np.arange(-_PERIOD // 2, _PERIOD // 2))
    spectrum = np.fft.rfft(2.0 ** -((lags / max(half, _WHITE)) ** 2)).real
    weights = np.fft.irfft(np.sqrt(np.maximum(spectrum, 0)))[np.arange(-reach, reach + 1)]
    return (weights / np.linalg.norm(weights)).astype(np.float32)


@lru_cache(maxsize=4096)
def frame_weights(frame: int, correlation: float) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
    """The frames whose white noise makes the noise of ``frame``, and with which weights; the squares sum to 1.

    The noise follows x' = r·x + sqrt(1 - r²)·white (AR(1)), made by bisection as one makes a Brownian bridge: every
    L-th frame is drawn by itself, then the frame in the middle given those two, then the quarters, and so on. L is the
    power of two from which on the correlation is below 1 %, so at most 2 + log2(L) pictures are needed: 4 for r = 0.2,
    6 for 0.7, 9 for 0.95; a sum over the frames before would take 90 for 0.95. The error is that frames L apart are
    independent: no correlation between two frames is off by more than 0.01.
    """
    length = 1
    while correlation**length > _FORGOTTEN:
        length *= 2
    low = frame - frame % length
    ends = {low: 1.0}, {low + length: 1.0}
    between = 0.0  # the correlation of the two ends
    made = ends[0]
    while frame != low:
        length //= 2
        r = correlation**length
        share = r / (1 + r * r)  # E[x(middle) | ends] = share · (x(low) + x(high)), by the Markov property
        made = {key: share * (ends[0].get(key, 0) + ends[1].get(key, 0)) for key in ends[0] | ends[1]}
        made[low + length] = float(np.sqrt(1 - 2 * share * share * (1 + between)))
        between = share * (1 + between)
        if frame < low + length:
            ends = ends[0], made
        else:
            low, ends = low + length, (made, ends[1])
    return np.array([number % 2**32 for number in made], np.uint32), np.array(list(made.values()), np.float32)


@kernel
def _sum_frames(start, stop, numbers, weights, key, out):
    """out = Σ weight · white noise of frame ``number``; ``start`` is a multiple of BLOCK."""
    words, values, total = np.empty(BLOCK, np.uint32), np.empty(BLOCK, np.float32), np.empty(BLOCK, np.float32)
    for at in range(start, stop, BLOCK):
        total[:] = _f(0)
        for n in range(numbers.size):
            normal_block(at // BLOCK, numbers[n], 0, key, words, values)
            weight = weights[n]
            for i in range(BLOCK):
                total[i] += weight * values[i]
        part = out[at : min(at + BLOCK, stop)]
        part[:] = total[: part.size]


@inlined
def _weigh(target, weights, source, step):
    """target[i] = Σ weights[k] · source[k · step + i].

    Four terms at a time, because loading and storing ``target`` costs as much as a term.
    """
    size, whole = target.size, weights.size // 4 * 4
    target[:] = _f(0)
    for k in range(0, whole, 4):
        w0, w1, w2, w3 = weights[k], weights[k + 1], weights[k + 2], weights[k + 3]
        a, b = source[k * step :][:size], source[(k + 1) * step :][:size]
        c, d = source[(k + 2) * step :][:size], source[(k + 3) * step :][:size]
        for i in range(size):
            target[i] += (w0 * a[i] + w1 * b[i]) + (w2 * c[i] + w3 * d[i])
    for k in range(whole, weights.size):
        w0, a = weights[k], source[k * step :][:size]
        for i in range(size):
            target[i] += w0 * a[i]


@kernel
def _smooth(start, stop, across, down, white, out):
    """Rows ``start`` to ``stop`` of ``white`` under the weights; white is larger than out by their sizes less one."""
    flat, wide = white.reshape(-1), white.shape[1]
    row = np.empty(wide, np.float32)
    for v in range(start, stop):
        _weigh(row, down, flat[v * wide :], wide)
        _weigh(out[v], across, row, 1)
