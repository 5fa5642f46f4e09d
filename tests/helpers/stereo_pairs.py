"""Rectified pairs whose disparity is known, drawn without depthsim's renderer."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Image = NDArray[np.uint8]


def textured(shape: tuple[int, int], disparity: float, seed: int = 0, blur: float = 1.2) -> tuple[Image, Image]:
    """A texture without frequencies near a pixel's, and the same moved exactly, by Fourier's shift."""
    rng = np.random.default_rng(seed)
    height, width = shape
    wide = width + 256
    spectrum = np.fft.rfft2(rng.normal(size=(height, wide)))
    fy, fx = np.fft.fftfreq(height)[:, None], np.fft.rfftfreq(wide)[None]
    spectrum *= np.exp(-2 * (np.pi * blur) ** 2 * (fx**2 + fy**2))
    pictures = [
        np.fft.irfft2(spectrum * np.exp(2j * np.pi * fx * move), s=(height, wide))[:, 128:-128]
        for move in (0.0, disparity)
    ]
    scale = 40 / pictures[0].std()
    left, right = (np.clip(120 + scale * one, 0, 255).round().astype(np.uint8) for one in pictures)
    return left, right


def dotted(
    shape: tuple[int, int], disparity: Callable[[float, float], float], *, seed: int = 0, gain: float = 1.0,
    noise: float = 2.0, height: float = 100.0, width: float = 0.8,
) -> tuple[Image, Image]:  # fmt: skip
    """Gaussian dots on black, as the projector's at night; ``disparity`` by a dot's place in the left image.

    width: standard deviation of a dot [px].
    """
    rng = np.random.default_rng(seed)
    pictures = np.full((2, *shape), 15.0)
    v, u = np.mgrid[-4:5, -4:5]
    for x, y in rng.uniform((-60, 4), (shape[1] + 60, shape[0] - 5), (shape[0] * (shape[1] + 120) // 60, 2)):
        for picture, place in zip(pictures, (x, x - disparity(x, y)), strict=True):
            row, column = round(y), round(place)
            if 4 <= column < shape[1] - 4 and 4 <= row < shape[0] - 4:
                bell = np.exp(-((u + column - place) ** 2 + (v + row - y) ** 2) / (2 * width**2))
                picture[row - 4 : row + 5, column - 4 : column + 5] += height * bell
    pictures[1] *= gain
    left, right = np.clip(pictures + rng.normal(0, noise, pictures.shape), 0, 255).round().astype(np.uint8)
    return left, right
