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
import numpy as np
from depthsim import Sensor, diagnose, generate, load_camera, load_trajectory, open_run

camera = load_camera("d435", 424, 240)
pose = load_trajectory("tour", "office", rate=30).matrices()[0]
frame = Sensor("office", camera, profile="paper").measure(pose, seed=1)
error = 1000 * (frame.depth - frame.clean.depth)[frame.depth > 0]
print(frame.depth_raw.shape, frame.depth_raw.dtype, f"{(frame.depth_raw == 0).mean():.1%} holes")
print(f"noise {np.median(np.abs(error)) * 1.48:.1f} mm")
""",
    "A trajectory makes a run of them, here with the sensor of a real D435, as if it were a recording.": """
made = generate("office", "tour", camera=camera, profile="d435", out="recording", frames=60, seed=2)
run = open_run("recording")
print(made.frames, "frames,", run.camera.name, run.depth(30).max(), "m at most")
""",
    "The diagnosis says what the paper's sensor lacks against that recording.": """
found = diagnose("recording", sensor="paper", out="report")
print(found)
""",
    "The report's sensor has the causes added. Against it there is no gap.": """
print(diagnose("recording", sensor="report/sensor.yaml").verdict)
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
            for told, code in PARTS.items():
                out = io.StringIO()
                with contextlib.redirect_stdout(out):
                    exec(compile(code, str(PAGE), "exec"), names)
                page += [f"{told}\n", f"```python{code}```\n", f"```text\n{out.getvalue().rstrip()}\n```\n"]
        finally:
            os.chdir(home)
    PAGE.write_text("\n".join(page).rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
