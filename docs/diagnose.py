"""Make the pictures of docs/diagnose.md: `./run python docs/diagnose.py`, about a minute.

A D435 in the office, whose noise grows with the angle of incidence and which sees no depth in the stereo shadow, is
diagnosed against the paper's sensor.
"""

import tempfile
from pathlib import Path

from rich.console import Console

from depthsim.gap import investigate
from depthsim.gap.depth.report.figures import pictures
from depthsim.gap.report.terminal import show
from depthsim.gap.report.words import Origin
from depthsim.presets import preset
from depthsim.runs.generate import generate
from depthsim.scenefile import load_scene
from depthsim.sensor import load_profile
from depthsim.trajectory import load_trajectory

OUT = Path(__file__).resolve().parent / "pictures"
TRUTH = """
effects:
  - material_noise
  - fill_rate
  - incidence_noise: {sigma: 0.04}
  - stereo_shadow
"""


def main() -> None:
    """Record, diagnose, and write the pictures and the terminal's page."""
    with tempfile.TemporaryDirectory() as folder:
        run, truth = Path(folder) / "run", Path(folder) / "truth.yaml"
        truth.write_text(TRUTH)
        scene, camera = load_scene("office"), preset("d435", 424, 240).model_copy(update={"rate": 3.0})
        path = load_trajectory("tour", scene, camera.rate, 40)
        generate(scene, path, camera, load_profile(truth), run, streams=("depth",))
        found = investigate(run, sensor="paper")
        for name, picture in pictures(found).items():
            file = OUT / f"diagnose_{name}.png"
            file.write_bytes(picture.png)
            print(f"{file}: {picture.caption}")
        show(Console(width=100, highlight=False), found.diagnosis, Origin("run", "report", "paper"))


if __name__ == "__main__":
    main()
