"""The clean cast of every scene against its peers, on the instruction set at hand and on a narrower one.

Embree's ``isa=`` sets ours and the bare loop; Open3D and Mitsuba take the widest instructions that they find, so that
the rows of a narrower set are in their favour.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from rich.table import Table

from benchmarks import peers, rough_tube
from benchmarks.measuring import Measure, Work, milliseconds, ratio
from depthsim.raycast import Caster, embree
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.trajectory import load_trajectory

SHIPPED = ("office", "tunnel", "corridor", "race", "forest", "wall")
PEERS = ("bare loop", "Open3D", "Mitsuba")


def views() -> Iterator[tuple[Scene, NDArray[np.float64]]]:
    """The six shipped scenes a third of the way along their first trajectory, the tube of 300k faces and the box."""
    for name in SHIPPED:
        scene = load_scene(name)
        poses = load_trajectory(None, scene, 30).matrices()
        yield scene, poses[len(poses) // 3]
    yield rough_tube.tube(300_000), rough_tube.view()
    yield rough_tube.box(), rough_tube.view()


def instruction_sets() -> list[str]:
    """Embree's best here, and avx2 where the best is wider."""
    with embree_on(""):
        return ["", "isa=avx2"] if embree.packet_lanes() == 16 else [""]


@contextmanager
def embree_on(configuration: str) -> Iterator[None]:
    """Make casters on that device."""
    before = os.environ.get("DEPTHSIM_EMBREE_CONFIG", "")
    os.environ["DEPTHSIM_EMBREE_CONFIG"] = configuration or before
    try:
        yield
    finally:
        os.environ["DEPTHSIM_EMBREE_CONFIG"] = before


@dataclass
class Figures:
    """Ours over each peer's time: one figure a scene, by instruction set and peer."""

    ratios: dict[tuple[str, str], list[float]]
    table: Table


def cast_every_scene(measure: Measure) -> Figures:
    """Cast 848x480 everywhere; the works of a scene take turns."""
    figures = Figures({}, Table("scene", "instructions", "packet", "ours", *PEERS, title="clean cast, ms a frame"))
    camera = rough_tube.camera()
    for scene, pose in views():
        works: dict[str, Work] = {}
        lanes: dict[str, int] = {}
        for instructions in instruction_sets():
            with embree_on(instructions):
                caster, lanes[instructions] = Caster(scene), embree.packet_lanes()
                works[f"ours {instructions}"] = partial(caster.cast, camera, pose, out=caster.cast(camera, pose))
                works[f"bare loop {instructions}"] = peers.bare_loop(scene, camera, pose)
        others = {
            "Open3D": peers.open3d_cast_rays(scene, camera, pose),
            "Mitsuba": peers.mitsuba_intersect(scene, camera, pose, "llvm_ad_rgb"),
        }
        works |= {name: other for name, other in others.items() if other is not None}
        seconds = measure(works)
        for instructions in instruction_sets():
            ours, cells = f"ours {instructions}", []
            for peer in PEERS:
                name = f"bare loop {instructions}" if peer == "bare loop" else peer
                if name not in seconds:
                    cells.append("not installed")
                    continue
                figures.ratios.setdefault((instructions, peer), []).append(ratio(seconds, ours, name))
                cells.append(f"{milliseconds(seconds[name]):.1f}")
            label = f"{scene.name}, {len(scene.faces):,}" if scene.name in SHIPPED else scene.name
            figures.table.add_row(
                label, instructions or "best", str(lanes[instructions]), f"{milliseconds(seconds[ours]):.1f}", *cells
            )
    return figures
