"""From recordings to the m of their materials, in one call."""

from collections.abc import Sequence
from pathlib import Path

from depthsim.camera import Camera
from depthsim.errors import InputError
from depthsim.material_fit.curve import Curve
from depthsim.material_fit.fit import PAPER_FLOOR, MaterialFit, SpreadKind, fit_curve
from depthsim.material_fit.run import measure_run
from depthsim.material_fit.wall import measure_wall
from depthsim.materials import Materials
from depthsim.presets import load_camera
from depthsim.runs.folder import Run, open_run
from depthsim.runs.layout import RECORD, list_name
from depthsim.scene import Scene
from depthsim.scenefile import load_scene


def fit_material(
    recording: str | Path | Run | Sequence[str | Path],
    *,
    tag: str | None = None,
    scene: str | Path | Scene | None = None,
    camera: str | Path | Camera | None = None,
    floor: float | None = PAPER_FLOOR,
    spread: SpreadKind = "spatial",
    materials: str | Path | Materials | None = None,
) -> list[MaterialFit]:
    """The paper's law std = floor·exp(m·d) for the materials of a recording, each fitted by itself.

    recording: a run, for every material that it sees; or folders of depth PNGs of a flat wall, named by distance, as
    :func:`~depthsim.material_fit.captures.find_captures` takes them. tag: the wall's material. scene: that of the run;
    its own by default. camera: of the wall's pictures; by default the camera.yaml there. floor: [m]; None to fit it
    too. spread: which std of a wall, over the image or over the frames. materials: where the scene's tags are from.
    Raises :class:`InputError` for a recording that cannot be read, or where no material can be fitted.
    """
    if isinstance(recording, Run) or scene is not None or is_run(recording):
        if not isinstance(recording, str | Path | Run):
            raise InputError("fit_material", "", "has a scene and several folders", "give one run, or walls alone")
        run = open_run(recording)
        place = scene if scene is not None else run.scene
        if place is None:
            raise InputError(run.path, "", "holds no scene", "give scene=")
        curves = measure_run(run, load_scene(place, materials=materials).started(float(run.stamps[0])))
    else:
        if not tag:
            raise InputError("tag", "", "is not given", "name the one material of the wall, such as cement")
        folders = [recording] if isinstance(recording, str | Path) else recording
        eye = None if camera is None else load_camera(camera)
        curves = [measure_wall([Path(folder) for folder in folders], tag, camera=eye)]
    pairs, _ = fit_curves(curves, floor=floor, spread=spread)
    return [fit for _, fit in pairs]


def is_run(recording: object) -> bool:
    """Whether a path is the folder of a run, and not of captures of a wall."""
    if not isinstance(recording, str | Path):
        return False
    return any((Path(recording) / name).is_file() for name in (list_name("depth"), RECORD))


def fit_curves(
    curves: Sequence[Curve], *, floor: float | None = PAPER_FLOOR, spread: SpreadKind = "spatial"
) -> tuple[list[tuple[Curve, MaterialFit]], list[InputError]]:
    """The curves that can be fitted, with their fits, and why the others cannot. Raises where none can."""
    pairs, faults = [], []
    for curve in curves:
        try:
            pairs.append((curve, fit_curve(curve, floor=floor, spread=spread)))
        except InputError as error:  # another material of the run may do
            faults.append(error)
    if not pairs:
        raise faults[0]
    return pairs, faults
