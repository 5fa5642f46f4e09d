"""A diagnosis on disk: diagnosis.json, the fitted sensor, the page with pictures, and what the viewer needs."""

from dataclasses import dataclass, replace
from pathlib import Path

import yaml

from depthsim.gap.depth.findings import Findings
from depthsim.gap.depth.report.drawing import DepthDrawing, measure_drawing
from depthsim.gap.depth.report.figures import pictures
from depthsim.gap.depth.report.page import report_page
from depthsim.gap.depth.where.residual import stub
from depthsim.gap.depth.where.shares import shares_npz
from depthsim.gap.diagnosis import Diagnosis
from depthsim.gap.report import words
from depthsim.gap.report.drawing import write_drawing
from depthsim.gap.report.figures import Picture
from depthsim.gap.report.folder import report_folder
from depthsim.gap.report.words import SENSOR, STUB, Origin
from depthsim.runs.storing import write_whole
from depthsim.scene import Scene
from depthsim.scenefile.save import save_scene
from depthsim.sensor.profile import Profile, profile_names

PAGE, SHARES, ORIGIN, BEFORE, SCENE = "index.html", "where.npz", "report.yaml", "before.yaml", "scene.yaml"
_STUB_HEAD = """from typing import ClassVar

from depthsim.sensor.effect import Effect, Stage, parameter
from depthsim.sensor.frame import Frame


"""


@dataclass(frozen=True)
class Named:
    """What the caller gave, where it was not the default: scene and sensor as names, paths or objects."""

    scene: str | Path | Scene | None = None
    sensor: str | Path | Profile | None = None
    materials: Path | None = None


Drawn = tuple[Origin, DepthDrawing, dict[str, Picture]]
"""What the words of a report are made with, what is drawn, and the pictures."""


def draw_report(found: Findings, folder: Path, named: Named | None = None) -> Drawn:
    """What takes the time of a report. It does not need the figures of what the gap costs."""
    origin = origin_of(found, folder, named or Named())
    drawing = measure_drawing(found, origin)
    return origin, drawing, pictures(drawing)


def write_report(found: Findings, folder: Path, named: Named | None = None, drawn: Drawn | None = None) -> Origin:
    """Write the report to ``folder``, whole or not at all; an earlier report there is replaced.

    named: what was diagnosed, for the commands that the report gives; by default the run's own scene and sensor.
    drawn: by :func:`draw_report`, in place of it. Gives back what the words of the report were made with. Raises
    :class:`InputError` where ``folder`` is anything else than a report, and where the disk refuses.
    """
    folder, diagnosis = Path(folder), found.diagnosis
    origin, drawing, pictures_drawn = drawn or draw_report(found, folder, named)
    page = report_page(diagnosis, drawing, pictures_drawn)
    with report_folder(folder) as part:
        if origin.scene == str(folder / SCENE):
            save_scene(replace(found.evidence.scene, look=None), part)
        if origin.sensor == str(folder / BEFORE):
            write_whole(part / BEFORE, found.profile.to_yaml().encode())
        write_whole(part / ORIGIN, _origin_yaml(origin, folder).encode())
        write_whole(part / SENSOR, sensor_yaml(found, origin).encode())
        write_whole(part / SHARES, shares_npz(found.evidence, found.places))
        if (text := stub_text(diagnosis)) is not None:
            write_whole(part / STUB, text.encode())
        write_drawing(drawing, part)
        write_whole(part / PAGE, page.encode())
        diagnosis.write(part)
    return origin


def origin_of(found: Findings, folder: Path, named: Named) -> Origin:
    """How run, scene and sensor are named on a command line; what has no file is given one in the report."""
    sensor = named.sensor
    if sensor is None:
        own = found.evidence.run.path / SENSOR
        sensor = own if own.is_file() else "paper"
    # What lies in an earlier report goes with it.
    if isinstance(sensor, Profile) or _lies_in(folder, sensor):
        sensor = folder / BEFORE
    scene = named.scene
    if isinstance(scene, Scene) or (scene is not None and _lies_in(folder, scene)):
        scene = folder / SCENE
    return Origin(
        run=str(found.evidence.run.path),
        report=str(folder),
        sensor=str(sensor),
        scene=None if scene is None else str(scene),
        materials=None if named.materials is None else str(named.materials),
    )


def _lies_in(folder: Path, name: str | Path) -> bool:
    return Path(name).is_file() and Path(name).resolve().parent == folder.resolve()


def sensor_yaml(found: Findings, origin: Origin) -> str:
    """The text of sensor.yaml: the fitted profile, under a comment that says what was added to which."""
    causes = found.diagnosis.causes
    head = f"Made by depthsim diagnose for the recording {origin.run}."
    if not causes:
        why = "no gap was found" if found.diagnosis.verdict == "no_gap" else "no effect was found that closes the gap"
        lines = [head, f"The same sensor as {found.profile.name}: {why}."]
    else:
        lines = [head, f"The sensor {found.profile.name} with what it lacked:"]
        for cause in causes:
            closes = words.closed_text(cause.closed_fraction, cause.ci95_closed)
            lines.append(f"- {cause.effect} closes {closes} of the gap")
        gone = sorted({e.id for e in found.profile.effects} - {e.id for e in found.fixed.effects})
        if gone:
            lines.append(f"- {', '.join(gone)} went, as the above stands in its place")
    lines.append(words.generate_command(origin))
    return "".join(words.comment(line) for line in lines) + found.fixed.to_yaml()


def stub_text(diagnosis: Diagnosis) -> str | None:
    """new_effect.py, the beginning of an effect for what is unexplained; None where nothing is."""
    left = diagnosis.unexplained
    if left is None or not words.lacks_an_effect(diagnosis):
        return None
    return '"""An effect that the bank lacks."""\n\n' + _STUB_HEAD + stub(left.where[0])


def _origin_yaml(origin: Origin, folder: Path) -> str:
    """report.yaml: absolute paths, names of what comes with depthsim, or files that lie in the report."""

    def lasting(name: str | None) -> str | None:
        if name is None or name in profile_names():
            return name
        path = Path(name)
        if path.parent == folder:
            return path.name
        return str(path.absolute()) if path.exists() else name

    keys = {"run": str(Path(origin.run).absolute()), "scene": lasting(origin.scene), "sensor": lasting(origin.sensor)}
    if origin.materials is not None:
        keys["materials"] = str(Path(origin.materials).absolute())
    return yaml.safe_dump({key: value for key, value in keys.items() if value is not None}, sort_keys=False)
