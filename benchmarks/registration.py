"""What registration says of recordings whose poses are right, or off, beside errors of the sensor that it must leave.

    ./run python benchmarks/registration.py [CASE ...] [--scene office] [--frames 60] [--size 320 180]

The errors of poses are of other formulas than `pose_noise`: a walk that is pulled back, and a chain of joints whose
encoders have steps. For each case: what the poses are off by, truly and as found, the root mean square of what is left
of the errors after registration, and what is told of the constant part.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from depthsim.gap.depth.data.registration import register
from depthsim.presets import preset
from depthsim.raycast import Caster
from depthsim.runs import Run
from depthsim.runs.generate import generate
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.sensor import Profile, effect_class
from depthsim.trajectory import Trajectory, load_trajectory
from depthsim.trajectory.tum import write_tum

Floats = NDArray[np.float64]
Rng = np.random.Generator


def none(stamps: Floats, rng: Rng) -> Floats:
    """(frames, 6) errors [rad] and [m]: no error."""
    return np.zeros((len(stamps), 6))


def pulled_walk(stamps: Floats, rng: Rng) -> Floats:
    """A walk with steps of equal size either way, pulled back towards 0: 3 mm and 0.4 deg over about 0.4 s."""
    x, out = np.zeros(6), []
    pull = 1 - np.exp(-np.diff(stamps, prepend=stamps[0] - 40)[:, None] / 0.4)
    for share in np.repeat(pull, [30, *[1] * (len(stamps) - 1)], axis=0) if len(stamps) else []:
        x = x * (1 - share) + np.sqrt(share * (2 - share)) * rng.choice([-1.0, 1.0], 6)
        out.append(x)
    size = np.array([np.radians(0.4)] * 3 + [0.003] * 3)
    return np.array(out)[-len(stamps) :] * size


def joints(stamps: Floats, rng: Rng) -> Floats:
    """Six joints in a row, 0.25 m apart, whose encoders have steps and whose hand-eye jitters with every frame."""
    swing = np.sin(np.outer(stamps - stamps[0], rng.uniform(0.5, 3, 6)) + rng.uniform(0, 6, 6))
    off = np.radians(0.25) * (np.round(swing * 40) - swing * 40)
    out = []
    for angles in off:
        pose = np.eye(4)
        for axis, angle in zip((2, 1, 1, 0, 1, 0), angles, strict=True):
            link = np.eye(4)
            link[:3, :3] = Rotation.from_rotvec(angle * np.eye(3)[axis]).as_matrix()
            link[0, 3] = 0.02
            pose = pose @ link
        jitter = np.radians(0.1) * rng.laplace(size=3), 0.001 * rng.laplace(size=3)
        pose[:3, 3] -= [0.12, 0, 0]
        out.append([*(Rotation.from_matrix(pose[:3, :3]).as_rotvec() + jitter[0]), *(pose[:3, 3] + jitter[1])])
    return np.array(out)


Errors = Callable[[Floats, Rng], Floats]
CASES: dict[str, tuple[Errors, dict[str, dict[str, object]]]] = {
    "none": (none, {}),
    "pulled_walk": (pulled_walk, {}),
    "joints": (joints, {}),
    "scale of 1 %": (none, {"baseline_scale": {"scale": 1.01}}),
    "time_offset of 20 ms": (none, {"time_offset": {"offset": 0.02}}),
    "rolling_shutter of 20 ms": (none, {"rolling_shutter": {"readout": 0.02}}),
    "thermal_drift of 2 %": (none, {"thermal_drift": {"drift": -0.02, "time_constant": 1.5}}),
    "fixed_pattern of 0.15 px": (none, {"fixed_pattern": {"size": 15}}),
    "offset of 0.3 px": (none, {"disparity_offset": {"offset": 0.3}}),
    "lens_distortion": (none, {"lens_distortion": {"k1": 0.01}}),
    "extrinsic_rotation of 1 deg": (none, {"extrinsic_rotation": {"x": 0.8, "y": -0.6, "z": 0.3}}),
    "correlated noise": (none, {"spatial_correlation": {}, "temporal_correlation": {"correlation": 0.8}}),
    "holes and tails": (none, {"range_dropout": {"rate": 0.3}, "heavy_tails": {"share": 0.05}, "stereo_shadow": {}}),
    "walk, scale, time_offset": (pulled_walk, {"baseline_scale": {"scale": 1.01}, "time_offset": {"offset": 0.02}}),
    "walk, pattern, drift": (pulled_walk, {"fixed_pattern": {"size": 15}, "thermal_drift": {"time_constant": 2.0}}),
}


def record(folder: Path, scene: Scene, size: tuple[int, int], frames: int, name: str, seed: int) -> tuple[Run, Floats]:
    """A recording whose groundtruth.txt is off, and by what."""
    errors, effects = CASES[name]
    camera = preset("d435", *size).model_copy(update={"rate": 15.0})
    path = load_trajectory(None, scene, camera.rate, frames)
    off = errors(path.stamps, np.random.default_rng([seed, sorted(CASES).index(name)]))
    given = path.matrices()
    turns = Rotation.from_rotvec(off[:, :3])
    positions = given[:, :3, 3] + np.einsum("nij,nj->ni", given[:, :3, :3], off[:, 3:])
    quaternions = (Rotation.from_matrix(given[:, :3, :3]) * turns).as_quat()
    noise = effect_class("disparity_noise")(sigma=0.08)
    profile = Profile(name="made", effects=(noise, *(effect_class(i)(**keys) for i, keys in effects.items())))
    generate(scene, Trajectory(path.stamps, positions, quaternions), camera, profile, folder, seed=seed)
    write_tum(path, folder / "groundtruth.txt")
    return Run.open(folder), off


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", metavar="CASE", help="some of them; all if none given")
    parser.add_argument("--scene", default="office")
    parser.add_argument("--frames", type=int, default=60)
    parser.add_argument("--size", type=int, nargs=2, default=(320, 180))
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    scene = load_scene(options.scene)
    caster = Caster(scene)
    table = Table(
        "case", "off [deg, mm]", "found", "± of it", "time [s]", "left [deg, mm]", "late [ms]", "mount [deg, mm]"
    )
    for name in options.cases or CASES:
        with tempfile.TemporaryDirectory() as folder:
            run, off = record(Path(folder) / "run", scene, tuple(options.size), options.frames, name, options.seed)
            found = register(run, caster)
        e = found.errors
        left = off - off.mean(axis=0) - found.corrections
        table.add_row(
            name, _pair(off.std(axis=0)), _pair(e.deviation), _pair(e.error), f"{e.correlation_time:.2f}",
            _pair(left.std(axis=0)), f"{1e3 * e.late:.1f}", _pair(np.abs(e.constant)),
        )  # fmt: skip
    Console(width=150).print(table)


def _pair(six: Floats) -> str:
    """Root mean squares of a turn [deg] and a shift [mm], where they are known."""
    turn, shift = (np.sqrt(np.nanmean(part**2)) if np.isfinite(part).any() else np.nan for part in (six[:3], six[3:]))
    return f"{np.degrees(turn):.3f}, {1e3 * shift:.2f}"


if __name__ == "__main__":
    main()
