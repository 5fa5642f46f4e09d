"""Make docs/thresholds.md from depthsim/gap/config.py: `./run python docs/thresholds.py`."""

from pathlib import Path

from pydantic import BaseModel

from depthsim.gap.config import DepthConfig, FlightConfig

OUT = Path(__file__).resolve().parent / "thresholds.md"
HEAD = """# The thresholds of the diagnoses

Made by `docs/thresholds.py` from `depthsim/gap/config.py`; do not edit. From Python, with one of them in another place:

```python
from depthsim.gap import diagnose
from depthsim.gap.config import DepthConfig

diagnose("run", sensor="paper", config=DepthConfig.varied(["select.most_causes=2"]))
```

The benchmarks `nulls.py`, `withheld.py run` and `withheld_flight.py` vary them by `--set select.most_causes=2`. What is
measured (the axes, their cells, the bins of the histograms) stands with its code in `depthsim/gap/depth/data/` and
`depthsim/gap/flight/data/`.
"""
TITLES = {"Depth, `depthsim diagnose`": DepthConfig, "Flight, `depthsim diagnose-flight`": FlightConfig}


def page() -> str:
    """The text of docs/thresholds.md."""
    parts = [HEAD]
    for title, config in TITLES.items():
        parts.append(f"## {title}\n")
        for name, field in config.model_fields.items():
            section = field.annotation
            assert isinstance(section, type) and issubclass(section, BaseModel)
            about = " ".join((section.__doc__ or "").split())
            rows = [f"| `{key}` | {one.default:g} | {one.description} |" for key, one in section.model_fields.items()]
            table = ["| name | default | what |", "| --- | --- | --- |", *rows]
            parts.append("\n".join([f"### {name}\n", f"{about}\n", *table]) + "\n")
    return "\n".join(parts)


if __name__ == "__main__":
    OUT.write_text(page(), encoding="utf-8")
