"""`daq validate` as a job of a service."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.service.jobs import ValidateRequest
from daq_cli.app.context import Invocation
from daq_cli.robot.remote.jobs import done_at_server, number_of

if TYPE_CHECKING:
    from model.machine_model.model import Model
    from server.jobs.results import ValidationData


def validate_at_server(
    call: Invocation, model: Model, name: str, traces: tuple[str, ...], parameters: tuple[str, ...] | None,
    joints: Sequence[int] | None, damping_ratio: float, report: Path | None,
) -> ValidationData:  # fmt: skip
    """The validation. Raises JobEndedError, and what the service refuses."""
    from server.jobs.results import ValidationJobResult

    request = ValidateRequest(
        traces=traces, model=number_of(call, model, name), parameters=parameters,
        joints=None if joints is None else tuple(joints), damping_ratio=damping_ratio,
    )  # fmt: skip
    found = done_at_server(call, request, report)
    assert isinstance(found, ValidationJobResult)
    return found.data
