"""An error of the service, as application/problem+json (RFC 9457)."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class FieldProblem(BaseModel):
    """One field of a request that cannot be accepted."""

    field: str
    """Path of the field, such as `spec.trajectory.amplitude`."""
    message: str
    """What is wrong with it, and what is allowed."""


class ProblemDetails(BaseModel):
    """What went wrong, and what to do about it."""

    model_config = ConfigDict(extra="allow")

    type: str
    """Kind of problem: its place on a page of the service."""
    title: str
    status: int
    detail: str
    """One line about this case."""
    advice: str = ""
    """What to do."""
    fields: tuple[FieldProblem, ...] = ()
    request_id: str | None = None
    """The same as in the service's log."""
