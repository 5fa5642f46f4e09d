"""The real recordings as runs with scenes: a D435 over a floor, a table from one place, a Kinect moved by hand.

They lie in a folder beside the checkout, as docs/real.md says. freiburg1_xyz is imported and reconstructed, as the
commands do it.
"""

from collections.abc import Iterator
from pathlib import Path

from depthsim.importing import import_recording
from depthsim.reconstruction.reconstruct import reconstruct
from depthsim.runs import Run

DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
WITH_SCENE, WITHOUT = ("d435_floor", "aligned_table"), "rgbd_dataset_freiburg1_xyz"


def real_sets(data: Path, kept: Path) -> Iterator[Run]:
    """Those that are there. kept: a folder for what is made of them."""
    for name in WITH_SCENE:
        if (data / name).is_dir():
            yield Run.open(data / name)
    if (data / WITHOUT).is_dir():
        made = kept / WITHOUT.removeprefix("rgbd_dataset_")
        if not made.is_dir():
            import_recording(data / WITHOUT, made)
            reconstruct(made)
        yield Run.open(made)
