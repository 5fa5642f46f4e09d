"""The matcher beside OpenCV's semi-global matcher, on rendered pairs that are spoiled as real ones are.

    ./run python benchmarks/stereo_matching.py [--views 2] [--width 848]

The pairs are rendered, so their disparity is known: of the pixels that both imagers see, how many are found within
0.5 px, how many are more than 2 px off, and how many are empty. Half of the pairs are night with the projector's dots,
half are day without. A matcher that is better here because it knows the renderer's noise would lose it once the pair is
spoiled: brighter on one side, darkened to the corners about another centre, rows that do not quite meet, out of focus,
saturated, noisy.
"""

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy import ndimage

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.measuring import machine
from depthsim.camera import Camera
from depthsim.materials import load_materials
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.scenefile import load_scene
from depthsim.stereo.matcher import Matcher
from depthsim.stereo.render import Renderer
from depthsim.stereo.settings import ActiveStereo, Light, Projector
from depthsim.trajectory import load_trajectory

Image = NDArray[np.float64]
Pair = tuple[Image, Image]
LIGHTS = {
    "night, dots": ActiveStereo(light=Light(ambient=0.02)),
    "day, no dots": ActiveStereo(light=Light(ambient=3.0), projector=Projector(power=0)),
}


def _darken(image: Image, centre: tuple[float, float], strength: float) -> Image:
    v, u = np.mgrid[: image.shape[0], : image.shape[1]] / image.shape[1]
    return np.asarray(image / (1 + strength * ((u - centre[0]) ** 2 + (v - centre[1]) ** 2)) ** 2)


def _rows(image: Image, least: float, most: float) -> Image:
    """Rows moved down by ``least`` at the left to ``most`` at the right [px]."""
    v, u = np.mgrid[: image.shape[0], : image.shape[1]].astype(float)
    shift = least + (most - least) * u / image.shape[1]
    return np.asarray(ndimage.map_coordinates(image, [v - shift, u], order=3, mode="nearest"))


def _blur(image: Image) -> Image:
    return np.asarray(ndimage.gaussian_filter(image, 0.8))


def _noisy(image: Image, seed: int) -> Image:
    return np.asarray(image + np.random.default_rng(seed).normal(0, 4, image.shape))


SPOILED: dict[str, Callable[[Image, Image], Pair]] = {
    "as rendered": lambda left, right: (left, right),
    "right 1.4 times as bright": lambda left, right: (left, 1.4 * right + 6),
    "dark corners, unlike": lambda left, right: (_darken(left, (0.45, 0.3), 1.2), _darken(right, (0.6, 0.25), 1.2)),
    "rows 0.3 px off": lambda left, right: (left, _rows(right, 0.3, 0.3)),
    "rows -0.3 to 0.3 px off": lambda left, right: (left, _rows(right, -0.3, 0.3)),
    "out of focus, 0.8 px": lambda left, right: (_blur(left), _blur(right)),
    "one out of focus, 0.8 px": lambda left, right: (left, _blur(right)),
    "2.5 times exposed": lambda left, right: (2.5 * left, 2.5 * right),
    "noise of 4 grey values": lambda left, right: (_noisy(left, 1), _noisy(right, 2)),
}  # fmt: skip


def pairs(camera: Camera, views: int, scenes: tuple[str, ...]) -> Iterator[tuple[str, Pair, Image, NDArray[np.bool_]]]:
    """Light, pair, disparity, and where both imagers see the surface."""
    for name in scenes:
        scene = load_scene(name)
        caster, poses = Caster(scene), load_trajectory(None, scene, 30.0).matrices()
        for light, settings in LIGHTS.items():
            renderer = Renderer(caster, camera, settings, load_materials())
            for at in np.linspace(0, len(poses) - 1, views + 1)[:-1].astype(int):
                clean = caster.cast(camera, poses[at], right=True)
                assert clean.right_sees is not None
                left, right = renderer.render(poses[at], 0, int(at), 2)
                truth = np.divide(camera.focal_baseline, clean.depth, where=clean.hit, out=np.zeros(camera.shape))
                inside = np.arange(camera.width) - truth > 8
                seen = clean.hit & (clean.right_sees > 0) & inside & (truth < 120) & (truth > 0)
                yield light, (left.astype(float), right.astype(float)), truth, seen


def matchers() -> dict[str, Callable[[NDArray[np.uint8], NDArray[np.uint8]], NDArray[np.float32]]]:
    """By name: ours, and OpenCV's where it is installed."""
    found: dict[str, Callable[..., NDArray[np.float32]]] = {"ours": Matcher().match}
    try:
        import cv2
    except ImportError:
        return found
    sgbm = cv2.StereoSGBM.create(0, 128, 5, 8 * 25, 32 * 25, 1, 31, 10, 100, 2)

    def padded(left: NDArray[np.uint8], right: NDArray[np.uint8]) -> NDArray[np.float32]:
        """It leaves the first 128 columns empty, so they are put before the images."""
        wide = [cv2.copyMakeBorder(image, 0, 0, 128, 0, cv2.BORDER_REPLICATE) for image in (left, right)]
        return sgbm.compute(*wide)[:, 128:].astype(np.float32) / np.float32(16)

    return found | {"OpenCV": padded}


def scores(disparity: NDArray[np.float32], truth: Image, seen: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Shares of the pixels that both see: within 0.5 px, more than 2 px off, empty."""
    error, found = np.abs(disparity - truth)[seen], (disparity > 0)[seen]
    return float((found & (error < 0.5)).mean()), float((found & (error > 2)).mean()), float((~found).mean())


def main(
    views: Annotated[int, typer.Option(min=1)] = 2,
    width: Annotated[int, typer.Option()] = 848,
    scenes: Annotated[str, typer.Option()] = "office,corridor",
) -> None:
    """Print the shares for each way of spoiling."""
    camera = preset("d435", width, {848: 480, 1280: 720, 640: 480}[width])
    console, found = Console(width=120), matchers()
    console.print(machine())
    table = Table(
        "", *(f"{name}: {light}" for light in LIGHTS for name in found), title="% within 0.5 px / beyond 2 px / empty"
    )
    results: dict[tuple[str, str, str], list[tuple[float, float, float]]] = {}
    for light, pair, truth, seen in pairs(camera, views, tuple(scenes.split(","))):
        for spoil, change in SPOILED.items():
            images = [np.clip(image + 0.5, 0, 255).astype(np.uint8) for image in change(*pair)]
            for name, match in found.items():
                results.setdefault((spoil, light, name), []).append(scores(match(*images), truth, seen))
    for spoil in (*SPOILED, "all"):
        cells = []
        for light in LIGHTS:
            for name in found:
                keys = [(one, light, name) for one in (SPOILED if spoil == "all" else [spoil])]
                mean = 100 * np.mean([score for key in keys for score in results[key]], axis=0)
                cells.append("{:.1f} / {:.1f} / {:.1f}".format(*mean))
        table.add_row(spoil, *cells)
    console.print(table)


if __name__ == "__main__":
    typer.run(main)
