"""`daq fit` as a job of a service."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import SpecError
from daq.contracts.service.jobs import FitRequest
from daq_cli.app.context import Invocation
from daq_cli.robot.remote.jobs import done_at_server, model_name, number_of

if TYPE_CHECKING:
    from model.fitting.options import FitOptions
    from model.machine_model.model import Model
    from server.jobs.results import FitData

MOST_STARTS = 20
"""Of one job."""


def fit_at_server(
    call: Invocation, begin: Model, traces: tuple[str, ...], held: tuple[str, ...], options: FitOptions, out: Path,
    report: Path | None,
) -> FitData:  # fmt: skip
    """The fit; its model is called as `out` is. Raises JobEndedError, and what the service refuses."""
    from server.jobs.results import FitJobResult

    if options.starts > MOST_STARTS:
        raise SpecError(f"--starts {options.starts}: a job may have up to {MOST_STARTS}")
    request = FitRequest(
        traces=traces, held_out=held, model=number_of(call, begin, f"begin of {out.stem}"),
        parameters=options.parameters, held=options.held, bounds=dict(options.bounds), use_priors=options.use_priors,
        method=options.method, starts=options.starts, seed=options.seed, loop=options.loop, name=model_name(out.name),
    )  # fmt: skip
    found = done_at_server(call, request, report)
    assert isinstance(found, FitJobResult)
    return found.data
