"""What objects that move cost a cast: ten of 10,000 faces in view, against the scene without them.

    ./run python benchmarks/moving.py [--processor-time] [SCENE ...]

848x480, clean geometry. "as one mesh" is the scene with the same objects where they are at that moment, as if they
stood: what they cost by being there. Both casts of a round are of one pose; the acceleration structure of what stands
is not built again, and the time is that of all a cast does, placing the objects included.
"""

import argparse
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from benchmarks import rough_tube
from benchmarks.measuring import Work, least_cpu, machine, side_by_side
from benchmarks.speed_cast import SHIPPED
from depthsim.moving import Instance, Mover
from depthsim.procedural.primitives import sphere
from depthsim.raycast import Caster
from depthsim.scene import Scene
from depthsim.scenefile import load_scene
from depthsim.trajectory import Trajectory, load_trajectory

COUNT, RADIUS = 10, 0.25
STAMP = 0.37


def with_objects(scene: Scene, pose: NDArray[np.float64], count: int = COUNT) -> Scene:
    """The scene and so many balls of 10,000 faces that move and turn, spread over what a camera at ``pose`` sees."""
    ball = sphere(RADIUS, scene.tags[0], 101, 51)
    rng, movers = np.random.default_rng(0), []
    vertices, faces = [scene.vertices], [scene.faces]
    for number in range(count):
        v, f = (sum(map(len, arrays)) for arrays in (vertices, faces))
        ahead = np.array([rng.uniform(-0.8, 0.8), rng.uniform(-0.45, 0.45), 1.0]) * rng.uniform(1.5, 4.0)
        place = pose[:3, :3] @ ahead + pose[:3, 3]
        turns = rng.normal(size=(2, 4))
        turns /= np.linalg.norm(turns, axis=1, keepdims=True)
        path = Trajectory([0.0, 1.0], np.stack([place, place + 0.05 * rng.normal(size=3)]), turns)
        movers.append(Mover(f"ball_{number}", (f, f + len(ball.faces)), (v, v + len(ball.vertices)), path))
        vertices.append(ball.vertices)
        faces.append(ball.faces + np.uint32(v))
    tags = np.concatenate([scene.face_tags, np.zeros(count * len(ball.faces), np.uint8)])
    known = (Instance(scene.name, len(scene.faces)), *(Instance(m.name, len(ball.faces)) for m in movers))
    return replace(
        scene, vertices=np.concatenate(vertices), faces=np.concatenate(faces), face_tags=tags, movers=tuple(movers),
        instances=known, look=None,
    )  # fmt: skip


def works(name: str, right: bool = False) -> dict[str, Work]:
    """The casts to be compared, of one shipped scene."""
    scene, camera = load_scene(name), rough_tube.camera()
    poses = load_trajectory(None, scene, 30).matrices()
    pose = poses[len(poses) // 3]
    moving = with_objects(scene, pose)
    casters = {"without": Caster(scene), "as one mesh": Caster(moving.at(STAMP)), "moving": Caster(moving)}
    found: dict[str, Work] = {}
    for label, caster in casters.items():
        out = caster.cast(camera, pose, right=right, stamps=STAMP)
        found[label] = partial(caster.cast, camera, pose, right=right, stamps=STAMP, out=out)
    return found


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=list(SHIPPED))
    parser.add_argument("--processor-time", action="store_true", help="for a machine that others use")
    parser.add_argument("--rounds", type=int, default=25)
    options = parser.parse_args()
    title = f"a cast with ten objects of 10,000 faces that move, ms ({machine()})"
    table = Table("scene", "right imager", "without", "as one mesh", "moving", "moving / without", title=title)
    for name in options.scenes:
        for right in (False, True):
            every = works(name, right)
            if options.processor_time:
                seconds = {label: [least] for label, least in least_cpu(every, options.rounds).items()}
            else:
                seconds = side_by_side(every, options.rounds)
            times = {label: float(np.median(own)) for label, own in seconds.items()}
            ratio = float(np.median(np.array(seconds["moving"]) / np.array(seconds["without"])))
            cells = (f"{1e3 * times[label]:.1f}" for label in every)
            table.add_row(name, "yes" if right else "no", *cells, f"{ratio:.2f}")
    Console(width=120).print(table)


if __name__ == "__main__":
    main()
