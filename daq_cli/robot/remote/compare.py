"""`daq compare` as a job of a service."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.errors import SpecError
from daq.contracts.service.jobs import CompareRequest
from daq_cli.app.context import Invocation
from daq_cli.robot.remote.jobs import done_at_server, number_of

if TYPE_CHECKING:
    from model.machine_model.model import Model
    from server.jobs.results import ComparisonData

MOST_MODELS = 10
"""Of one job."""


def compare_at_server(
    call: Invocation, names: Sequence[str], models: Sequence[Model], traces: tuple[str, ...], report: Path | None
) -> ComparisonData:
    """The comparison. Raises JobEndedError, and what the service refuses."""
    from server.jobs.results import ComparisonJobResult

    if len(models) > MOST_MODELS:
        raise SpecError(f"{len(models)} models: a job compares up to {MOST_MODELS}")
    numbers = tuple(number_of(call, model, name) for model, name in zip(models, names, strict=True))
    found = done_at_server(call, CompareRequest(traces=traces, models=numbers), report)
    assert isinstance(found, ComparisonJobResult)
    return found.data
