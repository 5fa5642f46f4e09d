"""A report as the viewer takes it: the diagnosis, its causes one by one, and where on the scene the gap lies."""

import os
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict

from depthsim.errors import InputError
from depthsim.gap.result import Diagnosis
from depthsim.runs.arrays import arrays_of
from depthsim.sensor import Profile, load_profile
from depthsim.sensor.effect import Effect, effect_class, effect_ids
from depthsim.yamlfile import parse_json, read_model, read_text, validate

DIAGNOSIS, ORIGIN, SENSOR, SHARES = "diagnosis.json", "report.yaml", "sensor.yaml", "where.npz"


class Origin(BaseModel):
    """report.yaml: what was diagnosed. Paths are absolute, or begin at the report's folder."""

    model_config = ConfigDict(extra="allow", frozen=True)

    run: str
    scene: str | None = None
    sensor: str = "paper"


@dataclass(frozen=True)
class Shares:
    """Where the gap lies. face: (faces,) float32, each face's share of the gap.

    image: (rows, columns) float32, the shares of the cells of a coarse grid over the image.
    """

    face: NDArray[np.float32]
    image: NDArray[np.float32]


@dataclass(frozen=True)
class Report:
    """A diagnosis, ready to be played with.

    before: the sensor that was diagnosed. after: the one with the causes added and fitted. causes: the effects that
    the diagnosis adds, in its order. shares: where the gap lies, None where the report does not say.
    """

    folder: Path
    diagnosis: Diagnosis
    before: Profile
    after: Profile
    causes: tuple[Effect, ...]
    shares: Shares | None = None

    def effects(self, chosen: Collection[int]) -> tuple[Effect, ...]:
        """The effects of the sensor with some of the causes added, by their numbers; all of them give ``after``.

        A cause replaces the effect of its id. An effect that ``after`` has not is one that a cause stands in for, so
        it goes as soon as a cause of its stage is there.
        """
        if len(chosen) == len(self.causes):
            return self.after.effects
        added = {self.causes[number].id: self.causes[number] for number in sorted(chosen)}
        stages = {effect.stage for effect in added.values()}
        last = {effect.id for effect in self.after.effects}
        kept = [
            effect
            for effect in self.before.effects
            if effect.id not in added and (effect.id in last or effect.stage not in stages)
        ]
        return (*kept, *added.values())

    def gap(self, chosen: Collection[int]) -> float:
        """The gap that is left with some of the causes added: each closes in proportion to its closed fraction."""
        gap, fractions = self.diagnosis.gap, [max(cause.closed_fraction, 0.0) for cause in self.diagnosis.causes]
        total = sum(fractions)
        part = sum(fractions[number] for number in chosen) / total if total > 0 else 0.0
        return gap.before - part * (gap.before - gap.after)


def is_report(folder: Path) -> bool:
    """Whether a folder is what `diagnose` writes."""
    return os.path.isfile(folder / DIAGNOSIS)  # which, unlike Path's, takes any text


def load_report(folder: Path) -> tuple[Report, Origin]:
    """Read a report, but for its shares: they are checked against the scene (:func:`load_shares`)."""
    diagnosis = _read_diagnosis(folder / DIAGNOSIS)
    if not (folder / SENSOR).is_file() and (folder / "vehicle.yaml").is_file():
        raise InputError(folder, "", "is the report of a flight", f"open {folder / 'index.html'} in place of it")
    origin = read_model(Origin, folder / ORIGIN, "a report.yaml, which names run and sensor")
    before = load_profile(origin.sensor if _comes_along(origin.sensor) else locate(folder, origin.sensor))
    after = load_profile(folder / SENSOR)
    fitted = {effect.id: effect for effect in after.effects}
    causes = []
    for number, cause in enumerate(diagnosis.causes):
        place = f"causes[{number}]"
        if cause.effect not in effect_ids():
            problem = f"there is no effect {cause.effect!r}"
            raise InputError(folder / DIAGNOSIS, place, problem, "name one of the effects")
        made = validate(effect_class(cause.effect), cause.parameters, folder / DIAGNOSIS, f"{place}.parameters")
        causes.append(fitted.get(cause.effect, made))
    return Report(folder, diagnosis, before, after, tuple(causes)), origin


def load_shares(folder: Path, faces: int | None) -> Shares | None:
    """where.npz of a report; None where there is none. faces: how many the scene has, None without a scene."""
    file = folder / SHARES
    if not file.is_file():
        return None
    try:
        arrays = arrays_of(file.read_bytes(), ("face_share", "image_share"))
        face, image = (np.asarray(array, np.float32) for array in arrays)
    except (OSError, ValueError) as error:
        problem = f"is not what diagnose writes ({' '.join(str(error).split())[:80]})"
        raise InputError(file, "", problem, "run diagnose again") from None
    if face.ndim != 1 or image.ndim != 2 or (faces is not None and len(face) != faces):
        problem = f"has shares of {face.shape} faces and {image.shape} cells; the scene has {faces} faces"
        raise InputError(file, "", problem, "run diagnose again")
    return Shares(np.nan_to_num(face), np.nan_to_num(image))


def locate(folder: Path, name: str) -> Path:
    """The path that report.yaml means."""
    return Path(name) if Path(name).is_absolute() else folder / name


def _comes_along(name: str) -> bool:
    from depthsim.sensor.profile import profile_names

    return name in profile_names()


def _read_diagnosis(file: Path) -> Diagnosis:
    try:
        value = parse_json(read_text(file, "a diagnosis.json"))
    except ValueError as error:
        raise InputError(file, "", f"is not JSON ({error})", "run diagnose again") from None
    return validate(Diagnosis, value, file)
