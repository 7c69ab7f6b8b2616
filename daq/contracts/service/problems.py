"""An error of the service, as application/problem+json (RFC 9457)."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class FieldProblem(BaseModel):
    """A rejected field of a request."""

    field: str
    """Path of the field, such as `spec.trajectory.amplitude`."""
    message: str
    """What is wrong with it, and what is allowed."""


class ProblemDetails(BaseModel):
    """An error and the advice on it."""

    model_config = ConfigDict(extra="allow")

    type: str
    """Kind of problem, as the address of its description on the service."""
    title: str
    status: int
    detail: str
    """A line about this case."""
    advice: str = ""
    """What to do."""
    fields: tuple[FieldProblem, ...] = ()
    request_id: str | None = None
    """The request's ID in the service's log."""
