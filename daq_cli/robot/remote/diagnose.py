"""`daq diagnose` as a job of a service."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.service.jobs import DiagnoseRequest
from daq_cli.app.context import Invocation
from daq_cli.robot.remote.jobs import done_at_server, model_name, number_of

if TYPE_CHECKING:
    from model.discrepancy.diagnosis import Diagnosis
    from model.discrepancy.options import DiagnosisOptions
    from model.machine_model.model import Model


def diagnose_at_server(
    call: Invocation, begin: Model, traces: tuple[str, ...], held: tuple[str, ...], options: DiagnosisOptions,
    out: Path | None, report: Path | None,
) -> Diagnosis:  # fmt: skip
    """The diagnosis. Raises JobEndedError, and what the service refuses."""
    from server.jobs.results import DiagnosisJobResult

    request = DiagnoseRequest(
        traces=traces, held_out=held, model=number_of(call, begin, "doubted"), effects=options.effects,
        joints=options.joints, most_steps=options.most_steps, name=None if out is None else model_name(out.name),
    )  # fmt: skip
    found = done_at_server(call, request, report)
    assert isinstance(found, DiagnosisJobResult)
    return found.data
