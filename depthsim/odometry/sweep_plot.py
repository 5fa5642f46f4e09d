"""The picture of a sweep."""

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from depthsim.odometry.sweep import Case

COLOURS = {"open3d-slam": "#00798c", "open3d-odometry": "#d1495b", "kiss-icp": "#edae49"}
_MARKS = "os^Dv*"


def picture(cases: "Sequence[Case]", title: str) -> bytes:
    """A PNG: on the left ATE over the noise of the depth, a mark a speed; on the right ATE by profile."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    systems = list(dict.fromkeys(case.system for case in cases))
    speeds = list(dict.fromkeys(case.speed for case in cases))
    profiles = list(dict.fromkeys(case.profile for case in cases))
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    for system in systems:
        for mark, speed in zip(_MARKS * len(speeds), speeds, strict=False):
            mine = [c for c in cases if (c.system, c.speed) == (system, speed) and c.score is not None]
            mine.sort(key=lambda case: case.noise)
            noise = [1000 * case.noise for case in mine]
            error = [100 * case.score.ate for case in mine if case.score]
            label = f"{system}, {speed:g}x" if len(speeds) > 1 else system
            left.plot(noise, error, mark + "-", color=COLOURS.get(system), ms=5, lw=1, label=label)
    left.set_xlabel("noise of the depth [mm]")
    left.set_ylabel("ATE [cm]")
    left.set_yscale("log")
    left.grid(alpha=0.25, which="both")
    left.legend(frameon=False, fontsize=8)
    groups = [(profile, speed) for profile in profiles for speed in speeds]
    width = 0.8 / len(systems)
    for place, system in enumerate(systems):
        for index, (profile, speed) in enumerate(groups):
            found = [c for c in cases if (c.profile, c.speed, c.system) == (profile, speed, system)]
            x = index + (place - (len(systems) - 1) / 2) * width
            for case in found:
                if case.score is None:
                    right.text(x, 0.02, "lost", rotation=90, ha="center", transform=right.get_xaxis_transform())
                else:
                    right.bar(x, 100 * case.score.ate, width, color=COLOURS.get(system))
                    if case.score.matched < case.frames:
                        right.text(x, 100 * case.score.ate, "cut", ha="center", va="bottom", fontsize=7)
    names = [f"{profile}\n{speed:g}x" if len(speeds) > 1 else profile for profile, speed in groups]
    right.set_xticks(range(len(groups)), names, fontsize=8)
    right.set_ylabel("ATE [cm]")
    right.set_yscale("log")
    right.grid(alpha=0.25, axis="y", which="both")
    figure.suptitle(title, fontsize=11)
    data = io.BytesIO()
    figure.savefig(data, format="png", dpi=100)
    plt.close(figure)
    return data.getvalue()
