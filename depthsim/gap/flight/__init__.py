"""The sim-to-real gap of a flight: where logged forces differ from the model's, which effects cause it, how far they
close it.

The residual is the specific force in the body frame, measured less modelled, both low-passed at 4 Hz. Its RMS per axis
is the gap, and its floor is the noise that the residual's own spectrum shows above the motion. RMS, rather than bits a
sample, because a force in m/s² can be read, added up over causes, and compared with other people's figures; bias and
slow changes are all in it, and correlation is what distinguishes them from noise, since everything is validated on
time held out.
"""

from collections.abc import Sequence
from pathlib import Path

from depthsim.flight.log import FlightLog
from depthsim.flight.nanobench import read_any
from depthsim.flight.vehicle import Vehicle, load_vehicle
from depthsim.gap.config import FlightConfig
from depthsim.gap.diagnosis import Diagnosis
from depthsim.gap.flight.diagnose import investigate
from depthsim.gap.flight.findings import Findings
from depthsim.gap.flight.report.write import write_report
from depthsim.gap.report.folder import check_report_folder

__all__ = ["Findings", "diagnose_flight", "investigate", "write_report"]


def diagnose_flight(
    logs: Sequence[FlightLog | str | Path] | FlightLog | str | Path,
    vehicle: Vehicle | str | Path,
    out: str | Path | None = None,
    without: Sequence[str] = (),
    seed: int = 0,
    config: FlightConfig = FlightConfig(),  # noqa: B008 - frozen
) -> Diagnosis:
    """Diagnose flights of one vehicle.

    logs: flights, or the files they are in. vehicle: one, or its file or name. out: a folder for diagnosis.json,
    vehicle.yaml and index.html; nothing is written if not given. without: effects that are left out of the bank.
    seed: of the bootstrap; the same seed gives the same result. config: the thresholds. Raises
    :class:`~depthsim.errors.InputError`.
    """
    if out is not None:
        check_report_folder(Path(out))
    given = [logs] if isinstance(logs, (FlightLog, str, Path)) else list(logs)
    flights = [read_any(log, drop_unmeasured=True) for log in given]
    craft = load_vehicle(vehicle)
    found = investigate(flights, craft, without, seed, config=config)
    if out is not None:
        write_report(Path(out), found)
        return found.diagnosis.in_report(out)
    return found.diagnosis
