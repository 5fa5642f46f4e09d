"""A case: drawn at random until the effect is there to be seen, then written as a run folder and its truth."""

import json
import zlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from benchmarks.withheld_data.axes import RIGHT_AXES
from benchmarks.withheld_data.film import Base, Film, Formula
from benchmarks.withheld_data.formulas import FORMULAS, OUTSIDE
from benchmarks.withheld_data.formulas.noise import OtherMaterial, SquareOfRange
from benchmarks.withheld_data.route import draw_route
from benchmarks.withheld_data.strength import Gauge, probe_frames, solve
from benchmarks.withheld_data.world import HOUSE, OWN, Rng, World, draw_world
from depthsim.camera import Camera
from depthsim.materials import load_materials
from depthsim.presets import preset
from depthsim.runs import layout
from depthsim.runs.storing import write_whole
from depthsim.runs.writer import RunWriter
from depthsim.scenefile.save import save_scene
from depthsim.trajectory.tum import tum_text

ATTEMPTS = 60
"""How many scenes are tried for one case."""
PAPER_ONLY = {"material_noise", "disparity_noise"}
"""Effects that the base in disparity cannot lack."""
HOLES_TO_FILL = {"hole_filling"}
"""Effects that want more holes than the paper's: the simulator has them, too."""
MOVING = {"time_offset", "rolling_shutter", "motion_noise"}
SHOWS_STILL = 0.4
"""Least part of an effect's statistic that is left beside the other effects, which may add to the noise."""
SEE_MUCH = 0.6
"""Least share of pixels that meet a surface."""


@dataclass(frozen=True)
class Wanted:
    """What to make.

    tier: a to e. effects: the ids that the simulator lacks; strengths: one each. frames and size: None draws them.
    against: for tier e, the profile that simulates the active stereo camera.
    """

    tier: str
    effects: tuple[str, ...] = ()
    strengths: tuple[str, ...] = ()
    seed: int = 0
    frames: int | None = None
    size: tuple[int, int] | None = None
    against: str = "paper"

    @property
    def name(self) -> str:
        """The case's folder."""
        pairs = [f"{e}-{s}" for e, s in zip(self.effects, self.strengths, strict=True)]
        against = [f"against-{self.against}"] if self.tier == "e" else []
        return "_".join([self.tier, *pairs, *against, f"{self.seed:03d}"])


@dataclass(eq=False)
class Case:
    """A film with its truth. shown: the strength of each formula, and its statistic on these frames."""

    wanted: Wanted
    film: Film
    shown: dict[Formula, tuple[str, float]] = field(default_factory=dict)
    offsets: dict[str, float] = field(default_factory=dict)
    attempts: int = 1


class CannotBeSeen(Exception):
    """No scene was found that shows the effect as strongly as it was asked for."""


def draw_case(wanted: Wanted) -> Case:
    """The same case for the same wish. Raises :class:`CannotBeSeen`."""
    for attempt in range(ATTEMPTS):
        rng = np.random.default_rng([wanted.seed, zlib.crc32(wanted.name.encode()), attempt])
        case = _attempt(rng, wanted)
        if case is not None:
            case.attempts = attempt + 1
            return case
    raise CannotBeSeen(f"{wanted.name}: not to be seen in {ATTEMPTS} scenes")


def write_case(case: Case, folder: Path) -> Path:
    """``folder``/run, the profile beside it in sensor.yaml, and the truth in case.json, written last."""
    film, run = case.film, folder / "run"
    if case.wanted.tier == "e":
        from benchmarks.withheld_data.active import profile_text, shoot

        _write_run(film, run, shoot(film))
        profile = profile_text(case.wanted.against)
    else:
        _write_run(film, run)
        profile = _profile(film.base)
    if film.rng("truth", 0).random() < 0.5:
        # As a tracking system gives them: denser than the frames.
        dense = np.unique(np.round(np.concatenate([np.arange(film.stamps[0], film.stamps[-1], 0.01), film.stamps]), 6))
        write_whole(run / layout.GROUND_TRUTH, tum_text(film.told(dense)).encode())
    write_whole(folder / "sensor.yaml", profile.encode())
    write_whole(folder / "case.json", (json.dumps(truth(case), indent=1) + "\n").encode())
    return run


def write_each_alone(case: Case, folder: Path) -> None:
    """The same frames with one of the effects each: ``folder``/0, 1, ..., in the order of the truth."""
    film, formulas = case.film, case.film.formulas
    for number, formula in enumerate(formulas):
        film.formulas = (formula,)
        _write_run(film, folder / str(number))
    film.formulas = formulas


def write_fresh(case: Case, run: Path) -> Path:
    """The same camera on the same way once more, at twice the frame rate and with other random numbers."""
    film = case.film
    rate = 2 * film.camera.rate
    stamps = np.round(np.arange(2 * len(film) - 1) / rate, 6)
    camera = film.camera.model_copy(update={"rate": rate})
    fresh = Film(film.world, film.route, camera, stamps, film.base, film.seed + 1)
    fresh.formulas = film.formulas
    _write_run(fresh, run)
    return run


def _write_run(film: Film, run: Path, picture: Callable[[int], NDArray[np.uint16]] | None = None) -> None:
    """picture: what is stored of a frame, the film's own by default."""
    picture = picture or (lambda index: film.units(film.make(index)))
    record = {"made_by": "a camera", "tags": list(film.world.scene.tags)}
    film.on_route = True
    with RunWriter(
        run, film.camera, film.told(film.stamps), record, overwrite=(run / layout.RECORD).exists()
    ) as writer:
        for index in range(len(film)):
            writer.write_frame(index, {"depth": picture(index)})
        save_scene(film.world.scene, run)
        writer.finish()


def truth(case: Case) -> dict[str, Any]:
    """What the diagnosis must find."""
    film, wanted = case.film, case.wanted
    effects = [
        {
            "effect": formula.effect,
            "formula": formula.name,
            "strength": case.shown[formula][0],
            "statistic": {formula.statistic: case.shown[formula][1]},
            "parameters": formula.parameters(),
            "known_parameters": formula.known(),
        }
        for formula in film.formulas
    ]
    record: dict[str, Any] = {
        "name": wanted.name,
        "tier": wanted.tier,
        "seed": wanted.seed,
        "effects": effects,
        "world": film.world.kind,
        "faces": len(film.world.scene.faces),
        "frames": len(film),
        "size": [film.camera.width, film.camera.height],
        "duration": film.route.duration,
        "base": {"sigma": film.base.sigma} if film.base.sigma else {"law": "paper"},
        "m": film.base.m,
        "m_offsets": case.offsets,
        "attempts": case.attempts,
    }
    if wanted.tier == "e":
        record["against"] = wanted.against
    if wanted.tier == "b":
        formula = film.formulas[0]
        outside = formula.effect in OUTSIDE
        record["without"] = [] if outside else [formula.effect]
        record["right_names"] = list(formula.names)
        record["right_axes"] = list(formula.axes if outside else RIGHT_AXES[formula.effect])
    return record


def _profile(base: Base) -> str:
    """What the simulator knows: the paper's profile, or noise of the disparity and holes."""
    rate: Any = {"fill_rate": {"rate": base.rate}}
    effects: list[Any] = ["material_noise", "fill_rate" if base.rate == 0.01 else rate]
    if base.sigma:
        effects = [{"disparity_noise": {"sigma": base.sigma}}, rate]
    return yaml.safe_dump({"name": "paper" if not base.sigma else "stereo", "effects": effects}, sort_keys=False)


def _attempt(rng: Rng, wanted: Wanted) -> Case | None:
    world = draw_world(rng, _kind(rng, wanted.effects))
    film = _draw_film(rng, wanted, world)
    if film is None:
        return None
    case = Case(wanted, film, offsets=_offsets(rng, film))
    chosen: list[Formula] = []
    for effect, strength in zip(wanted.effects, wanted.strengths, strict=True):
        kinds = FORMULAS.get(effect) or OUTSIDE[effect]
        formula = kinds[int(rng.integers(len(kinds)))](rng, film)
        value = solve(film, formula, strength, float(rng.random()))
        if value is None:
            return None
        chosen.append(formula)
        case.shown[formula] = strength, value
    # What sets the noise must come before what adds to it.
    film.formulas = tuple(sorted(chosen, key=lambda f: not isinstance(f, OtherMaterial | SquareOfRange)))
    if len(chosen) > 1 and not (_go_together(chosen) and _all_seen(film)):
        return None
    return case


def _go_together(formulas: list[Formula]) -> bool:
    """Only one formula may say what the noise is, and only one how it hangs together."""
    sets_noise = [f for f in formulas if isinstance(f, OtherMaterial | SquareOfRange)]
    sets_field = [f for f in formulas if type(f).field is not Formula.field]
    return len(sets_noise) <= 1 and len(sets_field) <= 1


def _all_seen(film: Film) -> bool:
    """With several effects: none of them is hidden by the others."""
    for formula in film.formulas:
        others = [other for other in film.formulas if other is not formula]
        statistic = "spread" if formula.statistic == "ratio_m" else formula.statistic
        if Gauge(film, statistic, others)(formula) < SHOWS_STILL * Gauge(film, statistic)(formula):
            return False
    return True


def _kind(rng: Rng, effects: tuple[str, ...]) -> str:
    """A kind of scene that can show these effects."""
    if "ambient_light" in effects:
        return "yard" if rng.random() < 0.75 else "room"
    if {"moved_region", "foreign_thing", "noisy_place", "specular_dropout"} & set(effects):
        return str(rng.choice(["room", "clutter", "yard"]))
    if {"flying_pixels", "edge_fattening", "stereo_shadow"} & set(effects) and rng.random() < 0.6:
        return "clutter"
    if rng.random() < 0.3:
        return "house:" + str(rng.choice(HOUSE, p=[0.35, 0.25, 0.2, 0.1, 0.1]))
    return str(rng.choice(OWN, p=[0.4, 0.2, 0.25, 0.15]))


def _draw_film(rng: Rng, wanted: Wanted, world: World) -> Film | None:
    """Camera, motion and base; None where the camera sees too little or stands in something."""
    drifts = "thermal_drift" in wanted.effects
    size = wanted.size or ((424, 240), (424, 240), (320, 180), (212, 120))[int(rng.integers(4))]
    frames = wanted.frames or int(rng.integers(16, 41))
    rate = float(rng.choice([0.5, 1, 2])) if drifts else float(rng.choice([5, 10, 15, 30]))
    camera = _camera(rng, size, rate)
    stamps = np.round(np.arange(frames) / rate, 6)
    if MOVING & set(wanted.effects):
        style = str(rng.choice(["lively", "lively", "hand", "glide"]))
    elif drifts:
        style = str(rng.choice(["still", "hand"]))
    else:
        style = str(rng.choice(["still", "hand", "lively", "glide"], p=[0.15, 0.35, 0.25, 0.25]))
    route = draw_route(rng, world, float(stamps[-1]), style)
    known = load_materials()
    m = {tag: known[tag].m for tag in world.scene.tags}
    paper = bool(PAPER_ONLY & set(wanted.effects)) or rng.random() < 0.8
    base = Base(m, 0.0, 0.01)
    if not paper:
        base = Base({}, float(rng.uniform(0.04, 0.1)), float(rng.uniform(0.005, 0.02)))
    if HOLES_TO_FILL & set(wanted.effects):
        base = replace(base, rate=float(np.exp(rng.uniform(np.log(0.015), np.log(0.15)))))
    film = Film(world, route, camera, stamps, base, int(rng.integers(2**31)))
    return film if _is_fair(film) else None


def _camera(rng: Rng, size: tuple[int, int], rate: float) -> Camera:
    """A D400 unit whose intrinsics are its own."""
    width, height = size
    like = preset(str(rng.choice(["d435", "d435", "d455"])), 848, 480)
    focal = like.fx * width / 848 * rng.uniform(0.93, 1.03)
    return Camera(
        name="camera",
        width=width,
        height=height,
        fx=float(focal),
        fy=float(focal),
        cx=float((width - 1) / 2 + rng.normal(0, 0.008) * width),
        cy=float((height - 1) / 2 + rng.normal(0, 0.008) * width),
        baseline=like.baseline,
        depth_scale=0.001,
        rate=rate,
    )


def _is_fair(film: Film) -> bool:
    """Surfaces in most of the image, at ranges of a depth camera, and the camera neither in nor right before one."""
    inside = film.world.solids
    eyes = film.poses[:, None, :3, 3]
    if inside.size and ((eyes > inside[:, 0] - 0.15) & (eyes < inside[:, 1] + 0.15)).all(axis=2).any():
        return False
    for index in probe_frames(film):
        depth = film.make(index, (), noise=False).z
        seen = depth[depth > 0]
        if seen.size < SEE_MUCH * depth.size or seen.min() < 0.12 or not 0.5 < np.median(seen) < 6.0:
            return False
    return True


def _offsets(rng: Rng, film: Film) -> dict[str, float]:
    """In half of the cases the real m of each material is off by up to 5 %, either way; given to the film."""
    if film.base.sigma or rng.random() < 0.5:
        return {}
    offsets = {tag: float(rng.uniform(-0.05, 0.05)) for tag in film.base.m}
    film.base = Base({tag: m * (1 + offsets[tag]) for tag, m in film.base.m.items()}, 0.0, film.base.rate)
    return offsets
