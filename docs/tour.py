"""Makes docs/tour.md: the code below the line, with what each part of it prints.

./run python docs/tour.py
"""

import contextlib
import io
import os
import tempfile
from pathlib import Path

PAGE = Path(__file__).resolve().with_name("tour.md")
PARTS = {
    "A scene, a camera and a sensor make a frame.": """
from pathlib import Path

import numpy as np
from depthsim import Sensor, compare, diagnose, generate, load_camera, load_trajectory, open_run

camera = load_camera("d435", 160, 90)
pose = load_trajectory("tour", "office", rate=30).matrices()[0]
frame = Sensor("office", camera, profile="paper").measure(pose, seed=1)
error = 1000 * (frame.depth - frame.clean.depth)[frame.depth > 0]
print(frame.depth_raw.shape, frame.depth_raw.dtype, f"{(frame.depth_raw == 0).mean():.1%} holes")
print(f"noise {np.median(np.abs(error)) * 1.48:.1f} mm")
""",
    "A trajectory makes a run of them; here by a profile of our own, noisier on slopes, as if it were a recording.": """
Path("mine.yaml").write_text("effects: [material_noise, fill_rate, {incidence_noise: {sigma: 0.05}}]")
made = generate("office", "tour", camera=camera, profile="mine.yaml", out="recording", frames=30, seed=2)
run = open_run("recording")
print(made.frames, "frames,", run.camera.name, run.depth(20).max(), "m at most")
""",
    "The diagnosis says what the paper's sensor lacks against that recording.": """
found = diagnose("recording", sensor="paper", out="report")
print(found)
""",
    "The sensor of the report has the causes added. What it simulates is compared with the recording.": """
generate("office", "tour", camera=camera, profile="report/sensor.yaml", out="simulated", frames=30, seed=3)
print(compare("recording", "simulated"))
""",
}
"""What the page says, and the code that follows."""


def main() -> None:
    """Run every part in one namespace, in an empty folder, and write the page."""
    names: dict[str, object] = {}
    page = [
        "# A tour in Python\n",
        "From a scene to a run to its diagnosis. `./run python docs/tour.py` runs the code and writes this page;",
        "in a notebook `found` alone shows the verdict, the causes and the curves.\n",
    ]
    with tempfile.TemporaryDirectory() as folder:
        home = Path.cwd()
        os.chdir(folder)
        try:
            for text, code in PARTS.items():
                out = io.StringIO()
                with contextlib.redirect_stdout(out):
                    exec(compile(code, str(PAGE), "exec"), names)
                page += [f"{text}\n", f"```python{code}```\n", f"```text\n{out.getvalue().rstrip()}\n```\n"]
        finally:
            os.chdir(home)
    PAGE.write_text("\n".join(page).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
