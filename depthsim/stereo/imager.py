"""From light to grey values: lens, exposure, noise and 8 bits."""

import math

import numpy as np
from numpy.typing import NDArray

from depthsim.camera import Camera
from depthsim.draws import Draws
from depthsim.kernels import kernel
from depthsim.parallel import split
from depthsim.stereo.settings import Imager

_PHOTON = 2.337e-19
"""[J] of a photon of 850 nm."""
WHITE = 255


@kernel
def _falloff_rows(start, stop, rays_x, rays_y, power, out):
    """Rows ``start`` to ``stop`` of 1 + x² + y² to a power, of rays (x, y, 1)."""
    for v in range(start, stop):
        for u in range(out.shape[1]):
            x, y = rays_x[v, u], rays_y[v, u]
            out[v, u] = (np.float32(1) + x * x + y * y) ** power


@kernel
def _gather_rows(start, stop, light, down, along, falloff, aperture, out):
    """Rows ``start`` to ``stop`` of a picture from ``light``, some rays a pixel, seen through weights down and along.

    falloff: what each pixel darkens by, (H, W). aperture: what all do.
    """
    height, width = out.shape
    rows, across = light.shape
    rays = across // width
    above, before = (down.size - rows // height) // 2, (along.size - rays) // 2
    line, total = np.empty(across, np.float32), np.empty(width, np.float32)
    # By their place in the pixel, so that what a weight is for lies side by side; at the border rays are repeated.
    apart = np.empty((rays, width + (along.size - 1) // rays), np.float32)
    for v in range(start, stop):
        line[:] = np.float32(0)
        for k in range(down.size):
            seen, weight = light[min(max(v * (rows // height) + k - above, 0), rows - 1)], down[k]
            for x in range(across):
                line[x] += weight * seen[x]
        for place in range(rays):
            ones, first = apart[place], place - before
            for i in range(ones.size):
                ones[i] = line[min(max(first + i * rays, 0), across - 1)]
        total[:] = np.float32(0)
        for k in range(along.size):
            seen, weight = apart[k % rays, k // rays : k // rays + width], along[k]
            for u in range(width):
                total[u] += weight * seen[u]
        for u in range(width):
            out[v, u] = total[u] * falloff[v, u] * aperture


@kernel
def _expose(start, stop, light, scale, gain, well, read, normals, grey):
    """Electrons with shot and read noise, and grey values of them.

    scale: electrons per unit of light. normals: (2, N) standard normal numbers.
    """
    for i in range(start, stop):
        electrons = light[i] * scale
        electrons += np.sqrt(max(electrons, np.float32(0))) * normals[0, i] + read * normals[1, i]
        value = electrons / well * gain * np.float32(WHITE) + np.float32(0.5)
        value = min(max(value, np.float32(0)), np.float32(WHITE))
        grey[i] = np.uint8(np.int32(value))


def spread_weights(blur: float, samples: int) -> NDArray[np.float32]:
    """Weights of rays for a pixel, n of them in it: the lens's Gaussian of ``blur`` [px], over the square pixel."""
    reach = int(np.ceil(3 * blur * samples))
    width = max(blur, 1e-6) * np.sqrt(2)
    rays = (np.arange(-reach, samples + reach) + 0.5) / samples
    seen = [math.erf(ray / width) - math.erf((ray - 1) / width) for ray in rays]
    return np.asarray(seen / np.sum(seen), np.float32)


def falloff(camera: Camera, imager: Imager, threads: int) -> NDArray[np.float32]:
    """(height, width) share of the light that the lens lets through to each pixel."""
    out = np.empty(camera.shape, np.float32)
    split(_falloff_rows, camera.height, threads, *camera.rays, np.float32(-2 * imager.vignetting), out)
    return out


def gather(
    light: NDArray[np.float32], falloff: NDArray[np.float32], camera: Camera, imager: Imager, threads: int
) -> NDArray[np.float32]:
    """(height, width) irradiance on the sensor [W/m²] from the radiance along some rays a pixel."""
    blur = imager.blur * camera.width / 848
    weights = [spread_weights(blur, rays // pixels) for rays, pixels in zip(light.shape, camera.shape, strict=True)]
    out, aperture = np.empty(camera.shape, np.float32), np.float32(np.pi / (4 * imager.f_number**2))
    split(_gather_rows, camera.height, threads, light, *weights, falloff, aperture, out)
    return out


def electrons_per_second(imager: Imager, camera: Camera) -> float:
    """Electrons a pixel and second for an irradiance of 1 W/m²."""
    pixel = imager.sensor_width / camera.width
    return pixel * pixel * imager.quantum_efficiency / _PHOTON


def exposure(images: list[NDArray[np.float32]], imager: Imager, camera: Camera) -> tuple[float, float]:
    """Exposure time [s] and gain: the fixed ones, or those that bring the images' mean to the target."""
    if imager.exposure != "auto":
        return float(imager.exposure), imager.gain
    mean = float(np.mean([image.mean(dtype=np.float64) for image in images]))
    wanted = imager.target * imager.full_well / max(mean * electrons_per_second(imager, camera), 1e-30)
    time = min(wanted, imager.longest_exposure)
    return time, min(max(wanted / time, 1.0), imager.highest_gain)


def develop(
    image: NDArray[np.float32], imager: Imager, camera: Camera, time: float, gain: float, draws: Draws, threads: int
) -> NDArray[np.uint8]:
    """(height, width) uint8 grey values of an irradiance."""
    grey = np.empty(image.shape, np.uint8)
    scale = np.float32(electrons_per_second(imager, camera) * time)
    normals = draws.normal((2, image.size))
    split(
        _expose, image.size, threads, image.reshape(-1), scale, np.float32(gain), np.float32(imager.full_well),
        np.float32(imager.read_noise), normals, grey.reshape(-1),
    )  # fmt: skip
    return grey
