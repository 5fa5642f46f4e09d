"""depthsim: a RealSense depth sensor on triangle meshes, and the diagnosis of its sim-to-real gap.

    from depthsim import Sensor, diagnose, generate

    Sensor("office", camera="d435", profile="paper").measure(pose).depth_raw
    generate("office", "tour", camera="d435", profile="paper", out="run", frames=60)
    diagnose("run", sensor="paper")

Wherever a scene, a camera, a profile, a trajectory, materials or a run is asked for, a name, a path or the object will
do. Names are looked up when they are first asked for, so that ``import depthsim`` costs nothing.
"""

from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOMES = {
    "Camera": "camera",
    "Diagnosis": "gap.diagnosis",
    "Effect": "sensor.effect",
    "Frame": "sensor.frame",
    "InputError": "errors",
    "Materials": "materials",
    "Motion": "sensor.motion",
    "Profile": "sensor.profile",
    "Run": "runs.folder",
    "Scene": "scene",
    "Sensor": "sensor.sensor",
    "Stage": "sensor.effect",
    "Trajectory": "trajectory.poses",
    "compare": "gap.depth.compare",
    "diagnose": "gap.depth.diagnose",
    "fit_material": "material_fit.material",
    "generate": "runs.generate",
    "load_camera": "presets",
    "load_profile": "sensor.profile",
    "load_scene": "scenefile.load",
    "load_trajectory": "trajectory.resolve",
    "open_run": "runs.folder",
    "parameter": "sensor.effect",
    "reconstruct": "reconstruction.reconstruct",
    "slam": "odometry.slam",
}
"""The module of each name."""

if TYPE_CHECKING:
    from depthsim.camera import Camera
    from depthsim.errors import InputError
    from depthsim.gap.depth.compare import compare
    from depthsim.gap.depth.diagnose import diagnose
    from depthsim.gap.diagnosis import Diagnosis
    from depthsim.material_fit.material import fit_material
    from depthsim.materials import Materials
    from depthsim.odometry.slam import slam
    from depthsim.presets import load_camera
    from depthsim.reconstruction.reconstruct import reconstruct
    from depthsim.runs.folder import Run, open_run
    from depthsim.runs.generate import generate
    from depthsim.scene import Scene
    from depthsim.scenefile.load import load_scene
    from depthsim.sensor.effect import Effect, Stage, parameter
    from depthsim.sensor.frame import Frame
    from depthsim.sensor.motion import Motion
    from depthsim.sensor.profile import Profile, load_profile
    from depthsim.sensor.sensor import Sensor
    from depthsim.trajectory.poses import Trajectory
    from depthsim.trajectory.resolve import load_trajectory

__all__ = [
    "Camera",
    "Diagnosis",
    "Effect",
    "Frame",
    "InputError",
    "Materials",
    "Motion",
    "Profile",
    "Run",
    "Scene",
    "Sensor",
    "Stage",
    "Trajectory",
    "__version__",
    "compare",
    "diagnose",
    "fit_material",
    "generate",
    "load_camera",
    "load_profile",
    "load_scene",
    "load_trajectory",
    "open_run",
    "parameter",
    "reconstruct",
    "slam",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    found = globals()[name] = getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
    return found


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
