"""Twelve diagnoses and the bytes of six runs, kept before a change of the code's structure and compared after it.

    ./run python qa/same_science.py keep before.json
    ./run python qa/same_science.py compare before.json [bytes] [depth] [flight]

Everything goes through the command line, so that any two versions can be compared. Causes, verdicts and words must be
equal, figures to 1e-9, and every picture of a run must have the same bytes. It takes about four minutes on two cores.
"""

import hashlib
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

REPOSITORY = Path(__file__).resolve().parent.parent
DATA = REPOSITORY.parent / "shared" / "data"
TOLERANCE = 1e-9
SMALL = ["--camera", "d435", "--resolution", "212x120", "--only-depth"]
PROFILES = {
    "moved": "effects: [material_noise, fill_rate, extrinsic_rotation: {x: 0.4, y: -0.3, z: 0.2}, time_offset]",
    "bent": "effects: [material_noise, lens_distortion, incidence_noise, material_dropout, vignetting_noise]",
    "edges": "effects: [disparity_noise, stereo_shadow, flying_pixels, edge_fattening, heavy_tails, invalid_band]",
    "late": "effects: [disparity_noise, rolling_shutter, temporal_correlation, spatial_correlation, thermal_drift]",
    "light": "effects: [disparity_noise, ambient_light, specular_dropout, motion_noise, lateral_noise, range_dropout]",
}
RUNS = {
    "office_paper": ("office", "paper", 12),
    "tunnel_moved": ("tunnel", "moved", 12),
    "corridor_bent": ("corridor", "bent", 12),
    "race_edges": ("race", "edges", 12),
    "forest_late": ("forest", "late", 12),
    "office_stereo": ("office", "active_stereo", 3),
    "wall_d435": ("wall", "d435", 12),
    "office_light": ("office", "light", 12),
}
KEPT_BYTES = ("office_paper", "tunnel_moved", "race_edges", "forest_late", "office_stereo", "office_light")
DEPTH = {
    "none": ("office_paper", "paper"),
    "moved": ("tunnel_moved", "paper"),
    "bent": ("corridor_bent", "paper"),
    "edges": ("race_edges", "d435"),
    "late": ("forest_late", "d435"),
    "d435": ("wall_d435", "paper"),
    "light": ("office_light", "paper"),
}


def depthsim(*words: object) -> None:
    """Run a command of this checkout, which need not be the one that is installed."""
    subprocess.run(
        [sys.executable, "-m", "depthsim", *map(str, words)],
        env={**os.environ, "PYTHONPATH": str(REPOSITORY)},
        check=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def diagnosis(folder: Path, sensor: str) -> dict[str, Any]:
    """What a report says: diagnosis.json, and the profile or vehicle with the causes added."""
    return {"diagnosis": json.loads((folder / "diagnosis.json").read_text()), "fixed": (folder / sensor).read_text()}


def byte_results(work: Path) -> dict[str, Any]:
    """The runs' bytes."""
    found: dict[str, Any] = {}
    for name, text in PROFILES.items():
        (work / f"{name}.yaml").write_text(f"name: {name}\ncamera: d435\n{text}\n")
    for name, (scene, profile, frames) in RUNS.items():
        sensor = f"{profile}.yaml" if profile in PROFILES else profile
        depthsim("generate", scene, "--sensor", sensor, "--frames", frames, "--seed", 5, *SMALL, "--out", name)
        if name in KEPT_BYTES:
            files = sorted(p for p in (work / name).rglob("*") if p.suffix in (".png", ".txt"))
            digests = {str(p.relative_to(work)): hashlib.sha256(p.read_bytes()).hexdigest() for p in files}
            found[f"bytes of {name}"] = digests
        print(f"made {name}", file=sys.stderr)
    return found


def depth_results(work: Path) -> dict[str, Any]:
    """The diagnoses of depth, of runs that were made."""
    found: dict[str, Any] = {}
    runs = {name: (work / run, sensor) for name, (run, sensor) in DEPTH.items()}
    if (DATA / "d435_floor").is_dir():
        runs["real floor"] = (DATA / "d435_floor", "paper")
    for name, (run, sensor) in runs.items():
        report = work / f"report {name}"
        depthsim("diagnose", run, "--sensor", sensor, "--out", report)
        found[f"depth {name}"] = diagnosis(report, "sensor.yaml")
        print(f"diagnosed {name}", file=sys.stderr)
    return found


def flight_results(work: Path) -> dict[str, Any]:
    """The diagnoses of flights: three simulated ones, whose vehicle lacks what they flew with, and real ones."""
    found: dict[str, Any] = {}
    path = "lemniscate:size=20/10,center=0/0/3,laps=2"
    flights = {
        "still": ["--vehicle", "f450", "--speed", "4"],
        "windy": ["--vehicle", "f450", "--speed", "5", "--wind", "2/1/0"],
        "fast": ["--vehicle", "hummingbird", "--speed", "6"],
    }
    for name, words in flights.items():
        depthsim("fly", path, *words, "--out", work / f"flight {name}")
        vehicle = work / f"flight {name}" / "vehicle.yaml"
        lacking = work / f"{name}_vehicle.yaml"
        import yaml

        known = yaml.safe_load(vehicle.read_text())
        known["drag"] = {"law": "none"}
        known.pop("wind", None)
        lacking.write_text(yaml.safe_dump(known))
        report = work / f"flight report {name}"
        depthsim("diagnose-flight", work / f"flight {name}" / "flight.csv", "--vehicle", lacking, "--out", report)
        found[f"flight {name}"] = diagnosis(report, "vehicle.yaml")
        print(f"diagnosed flight {name}", file=sys.stderr)
    return found


def differences(place: str, before: Any, after: Any) -> list[str]:
    """Where two results differ."""
    if isinstance(before, dict) and isinstance(after, dict):
        keys = dict.fromkeys([*before, *after])
        return [d for k in keys for d in differences(f"{place}/{k}", before.get(k), after.get(k))]
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        pairs = enumerate(zip(before, after, strict=True))
        return [d for n, (x, y) in pairs for d in differences(f"{place}[{n}]", x, y)]
    if isinstance(before, float) and isinstance(after, float):
        same = math.isclose(before, after, rel_tol=TOLERANCE, abs_tol=TOLERANCE)
    else:
        same = before == after
    return [] if same else [f"{place}: {str(before)[:160]!r} -> {str(after)[:160]!r}"]


def main() -> int:
    """``keep FILE`` or ``compare FILE``, and which of the three parts; all if none is given."""
    what, file = sys.argv[1], Path(sys.argv[2]).absolute()
    makers = {"bytes": byte_results, "depth": depth_results, "flight": flight_results}
    parts = [name for name in makers if name in (sys.argv[3:] or makers)]
    if "depth" in parts and "bytes" not in parts:
        sys.exit("depth needs bytes, which makes the runs")
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        os.chdir(work)
        every = {key: value for name in parts for key, value in makers[name](work).items()}
        found = json.loads(json.dumps(every).replace(str(work), "WORK"))
    if what == "keep":
        file.write_text(json.dumps(found, indent=1))
        return 0
    wrong = differences("", json.loads(file.read_text()), found)
    print("\n".join(wrong) or f"{len(found)} results are the same")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
