"""Every reader of depthsim, with a valid input for it: what is fuzzed."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from qa.fuzzing import more_seeds as more
from qa.fuzzing import seeds


@dataclass(frozen=True)
class Reader:
    """One reader.

    seed: writes a valid input into an empty folder. read: reads such a folder, and gives back anything; ``out`` is a
    path where nothing is. only: the endings of the files that are mutated, all if there are none. given: the files hold
    what is given on the command line, and so are always there.
    """

    name: str
    seed: Callable[[Path], None]
    read: Callable[[Path, Path], Any]
    only: tuple[str, ...] = ()
    given: bool = False


@cache
def _known() -> Any:
    """The materials that come with depthsim; to read them takes ten times as long as a small mesh."""
    from depthsim.materials import load_materials

    return load_materials()


def _scene(folder: Path, out: Path) -> Any:
    from depthsim.scenefile import load_scene
    from depthsim.scenefile.inspect import inspect_scene

    found = []
    for file in sorted(folder.iterdir()):
        if file.suffix in (".obj", ".ply", ".gltf", ".glb", ".stl", ".off"):
            found.append(load_scene(file, tags={"*": "cement"}, materials=_known()))
            found.append(inspect_scene(file, materials=_known()))
    return found


def _scene_file(folder: Path, out: Path) -> Any:
    from depthsim.scenefile import load_scene
    from depthsim.trajectory import load_trajectory

    scene = load_scene(folder / "scene.yaml", materials=_known())
    for name in scene.trajectories:
        load_trajectory(name, scene, rate=10)
    return scene


def _builders(folder: Path, out: Path) -> Any:
    from depthsim.scenefile import load_scene

    # The whole ones take up to a second each to build, and are always the same.
    changed = [file for file in sorted(folder.glob("*.yaml")) if not _is_whole(file)]
    return [load_scene(file, materials=_known()) for file in changed]


def _tags(folder: Path, out: Path) -> Any:
    from depthsim.cli.options import parse_resolution, parse_tags
    from depthsim.scenefile import load_scene

    text = _choice(folder, 0)
    load_scene(folder / "scene.obj", tags=parse_tags(text.split("\n")), materials=_known())
    return parse_resolution(_choice(folder, 1))


def _profile(folder: Path, out: Path) -> Any:
    from depthsim.sensor import load_profile

    return [load_profile(folder / f"{name}.yaml").to_yaml() for name in ("mine", "stereo", "given")]


def _materials(folder: Path, out: Path) -> Any:
    from depthsim.materials import load_materials

    return load_materials(folder / "materials.yaml").tags


def _camera(folder: Path, out: Path) -> Any:
    from depthsim.camera import read_camera

    return read_camera(folder / "camera.yaml").to_yaml()


def _matcher(folder: Path, out: Path) -> Any:
    from depthsim.stereo.settings import MatcherSettings
    from depthsim.yamlfile import read_model

    return read_model(MatcherSettings, folder / "settings.yaml", "the matcher's settings")


def _tum(folder: Path, out: Path) -> Any:
    from depthsim.trajectory import load_trajectory

    poses = load_trajectory(folder / "groundtruth.txt")
    return poses.matrices(), load_trajectory(folder / "groundtruth.txt", rate=30)


def _trajectory_files(folder: Path, out: Path) -> Any:
    from depthsim.trajectory import load_trajectory

    return [load_trajectory(file, rate=10).matrices() for file in sorted(folder.glob("*.yaml"))]


def _trajectory_words(folder: Path, out: Path) -> Any:
    from depthsim.trajectory import load_trajectory

    return [load_trajectory(choice, rate=10).matrices() for choice in _choices(folder)]


def _path_words(folder: Path, out: Path) -> Any:
    from depthsim.flight.pathspec import resolve_path

    return [resolve_path(choice, speed=1.0).duration for choice in _choices(folder)]


def _wind_words(folder: Path, out: Path) -> Any:
    from depthsim.flight.wind import make_air
    from depthsim.flight.windfile import resolve_wind

    return [make_air(resolve_wind(choice), duration=1.0) for choice in _choices(folder)]


def _camera_words(folder: Path, out: Path) -> Any:
    from depthsim.flight.vehicle import load_vehicle
    from depthsim.presets import resolve_camera
    from depthsim.sensor import load_profile

    camera, profile, vehicle = _choices(folder)
    return resolve_camera(camera), load_profile(profile), load_vehicle(vehicle)


def _run(folder: Path, out: Path) -> Any:
    from depthsim.dataset import STREAMS, DepthDataset
    from depthsim.runs import Run

    run = Run.open(folder)
    kept = [run.tags, run.poses, run.scene, run.meta]
    for index in range(len(run)):
        kept += [
            run.depth(index),
            run.clean(index),
            run.material(index),
            run.normal(index),
            run.rgb(index),
            run.mask(index),
        ]
    data = DepthDataset(folder, tuple(stream for stream in STREAMS if run.has(stream)))
    return kept, data[0] if len(data) else None


def _png(folder: Path, out: Path) -> Any:
    from depthsim.runs.png import decode_png, is_whole_png

    return [(decode_png(file), is_whole_png(file)) for file in sorted(folder.glob("*.png"))]


def _imported(folder: Path, out: Path) -> Any:
    from depthsim.importing import import_recording
    from depthsim.runs import Run

    made = import_recording(folder, out)
    return made, Run.open(out, posed=made.posed)


def _bag(folder: Path, out: Path) -> Any:
    return _imported(folder / "bag" if (folder / "bag").is_dir() else folder, out)


def _storage(folder: Path, out: Path) -> Any:
    (name,) = (
        name for name in ("bag.mcap", "bag.db3") if (folder / "bag" / "metadata.yaml").read_text().find(name) >= 0
    )
    return _imported(folder / "bag" / name, out)


def _captures(folder: Path, out: Path) -> Any:
    from depthsim.material_fit.captures import find_captures

    return find_captures([folder])


def _flight(folder: Path, out: Path) -> Any:
    from depthsim.flight.nanobench import read_any

    file = folder / "flight.csv"
    log = read_any(file, drop_unmeasured=True)
    return log.rotations, log.total_thrust, read_any(file)


def _vehicle(folder: Path, out: Path) -> Any:
    from depthsim.flight.vehicle import load_vehicle

    vehicle = load_vehicle(folder / "vehicle.yaml")
    return vehicle.to_yaml(), vehicle.mixer, vehicle.drag_parameters, vehicle.tuning


def _wind(folder: Path, out: Path) -> Any:
    from depthsim.flight.wind import make_air
    from depthsim.flight.windfile import resolve_wind

    return [
        make_air(resolve_wind(str(folder / name)), duration=1.0) for name in ("wind.yaml", "shear.yaml", "grid.csv")
    ]


def _flight_spec(folder: Path, out: Path) -> Any:
    from depthsim.flight.spec import read_flight_spec

    return [read_flight_spec(folder / name) for name in ("flight.yaml", "inline.yaml")]


def _report(folder: Path, out: Path) -> Any:
    from viewer.opening import open_stage

    return open_stage(folder / "report", materials=_known())


def _sweep(folder: Path, out: Path) -> Any:
    from depthsim.sweep.resolve import resolve_sweep

    return resolve_sweep(folder / "SWEEP.yaml")


def _choice(folder: Path, number: int) -> str:
    return (folder / f"choice{number}.txt").read_bytes().decode("utf-8", "surrogateescape")


def _choices(folder: Path) -> Iterator[str]:
    """Lines of the command line; the system lets no NUL through there."""
    count = len(list(folder.glob("choice*.txt")))
    yield from (_choice(folder, number).replace("\0", "") for number in range(count))


def _tag_seed(folder: Path) -> None:
    seeds.obj(folder)
    more.words("cement=plastic\n*=cement", "848x480")(folder)


def _png_seed(folder: Path) -> None:
    from depthsim.runs.png import encode_png

    (folder / "depth.png").write_bytes(encode_png(seeds.depth()))


def _camera_seed(folder: Path) -> None:
    import yaml

    keys = yaml.safe_load(seeds.CAMERA.to_yaml()) | {"model": "brown_conrady", "distortion": [0.01, 0, 0.001, 0, 0]}
    (folder / "camera.yaml").write_text(yaml.safe_dump(keys, sort_keys=False))


_BUILDERS = {"corridor.yaml": {"seed": 1}, "wall.yaml": {"material": "cement", "width": 20.0, "height": 20.0},
             "tunnel.yaml": {"seed": 1, "rows": 100, "around": 60}}  # fmt: skip


def _builder_text(name: str) -> str:
    import yaml

    return yaml.safe_dump({"meshes": [{"build": name.removesuffix(".yaml"), "parameters": _BUILDERS[name]}]})


def _builder_seed(folder: Path) -> None:
    for name in _BUILDERS:
        (folder / name).write_text(_builder_text(name))


def _is_whole(file: Path) -> bool:
    text = _builder_text(file.name) if file.name in _BUILDERS else ""
    return bool(text) and file.is_file() and file.read_bytes() == text.encode()


READERS: dict[str, Reader] = {
    reader.name: reader
    for reader in (
        Reader("scene OBJ", seeds.obj, _scene),
        Reader("scene PLY text", seeds.ply_ascii, _scene),
        Reader("scene PLY binary", seeds.ply_binary, _scene),
        Reader("scene glTF", seeds.gltf, _scene),
        Reader("scene GLB", seeds.glb, _scene),
        Reader("scene STL", seeds.stl, _scene),
        Reader("scene OFF", seeds.off, _scene),
        Reader("scene YAML", seeds.scene, _scene_file, (".yaml", ".txt")),
        Reader("scene builder", _builder_seed, _builders),
        Reader("tag map", _tag_seed, _tags, (".txt",), given=True),
        Reader("sensor profile", more.profile, _profile),
        Reader("materials", more.materials, _materials),
        Reader("camera", _camera_seed, _camera),
        Reader("matcher settings", more.matcher, _matcher),
        Reader("trajectory TUM", seeds.poses, _tum),
        Reader("trajectory YAML", more.shapes, _trajectory_files),
        Reader("trajectory in a line", more.words("circle:radius=2,speed=1,center=0/0/1,look_at=0/0/0",
               "waypoints:points=0/0/1;1/0/1;1/1/1,speed=1,ease=true"), _trajectory_words, given=True),
        Reader("camera, profile, vehicle by name", more.words("d435", "paper", "f450"), _camera_words, given=True),
        Reader("run", seeds.run, _run),
        Reader("PNG", _png_seed, _png),
        Reader("import TUM", seeds.tum_sequence, _imported),
        Reader("import pictures", seeds.picture_folder, _imported),
        Reader("bag ROS 1", more.ros1, _bag),
        Reader("bag RealSense", more.realsense, _bag),
        Reader("bag MCAP", more.mcap, _bag),
        Reader("bag MCAP file", more.mcap, _storage, (".mcap",)),
        Reader("bag sqlite3", more.sqlite3, _bag),
        Reader("bag sqlite3 file", more.sqlite3, _storage, (".db3",)),
        Reader("captures", seeds.captures, _captures),
        Reader("flight log", more.flight, _flight),
        Reader("flight log NanoBench", more.nanobench, _flight),
        Reader("vehicle", more.vehicle, _vehicle),
        Reader("wind", more.wind, _wind),
        Reader("wind in a line", more.words("3/0/0", "gusts:velocity=6/0/0,altitude=10",
        "shear:velocity=8/0/0,height=10"),
               _wind_words, given=True),
        Reader("flight path in a line", more.words("circle:radius=5,laps=2", "lemniscate:size=20/10,center=0/0/2",
               "minimum_snap:points=0/0/2;3/1/2;5/0/3", "hover:time=5", "shuttle:length=20"), _path_words, given=True),
        Reader("flight YAML", more.flight_spec, _flight_spec),
        Reader("report", more.report, _report),
        Reader("sweep", more.sweep, _sweep, (".yaml",)),
    )
}  # fmt: skip
"""By name."""
