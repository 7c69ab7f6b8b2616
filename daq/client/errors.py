"""Errors between client and service: one line each, with advice."""

from __future__ import annotations

import httpx

from daq.contracts.errors import DaqError, ReachError
from daq.contracts.exit_codes import NOT_REACHED, PROGRAM_FAULT, REFUSED, STOPPED, WRONG_INPUT
from daq.contracts.service.problems import ProblemDetails

_OF_KIND = {"beyond-limits": REFUSED, "port-in-use": NOT_REACHED, "stopped": STOPPED}
_OF_STATUS = {409: REFUSED, 429: NOT_REACHED, 500: PROGRAM_FAULT, 503: NOT_REACHED, 507: REFUSED}


class ServiceError(DaqError):
    """The service refused a request. `problem`: its application/problem+json; `kind`: the end of the problem's type
    (docs/service.md); `exit_code`: the exit code of a local command for the same refusal."""

    def __init__(self, problem: ProblemDetails) -> None:
        advice = f"; {problem.advice}" if problem.advice else ""
        super().__init__(f"{problem.detail}{advice}")
        self.problem = problem
        self.kind = problem.type.rpartition("#")[2]
        of_status = _OF_STATUS.get(problem.status, WRONG_INPUT)
        self.exit_code = _OF_KIND.get(self.kind, of_status)  # type: ignore[misc]

    @property
    def status(self) -> int:
        """HTTP status code of the response."""
        return self.problem.status


class ServiceNotReachedError(ReachError):
    """The service does not answer, or another program answers."""


def reason_of(error: httpx.HTTPError) -> str:
    """Returns why a request got no answer, in a few words."""
    return "no answer in time" if isinstance(error, httpx.TimeoutException) else str(error) or type(error).__name__
