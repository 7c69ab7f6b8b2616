"""The audit log: each request to the service, its sender and its result."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AwareDatetime, Field

from daq.contracts.service.base import Wire

Outcome = Literal["done", "refused", "failed"]
"""`refused`: nothing was changed, and the sender was told why. `failed`: the service could not carry it out."""


class AuditNote(Wire):
    """A request, before it is in the log."""

    at: AwareDatetime
    actor: str | None = None
    """Name of the sender's token; `local` for a user of the service's computer; None for an unknown sender."""
    role: str | None = None
    origin: str
    """Address of the sender's computer (or of the proxy, if there is one); or `command line`, `service`."""
    action: str
    """Name of the operation in the API's description, or of the command."""
    request: str = ""
    """Method and path of the request, or the command."""
    robot: str | None = None
    subject: str | None = None
    """ID or name of the object that was made or changed."""
    outcome: Outcome
    status: int | None = None
    """HTTP status of the response."""
    detail: str = ""
    """Why it was refused, the arm's answer, or the name and times of an experiment that was added."""
    content: str | None = None
    """Body of the request: JSON without secrets. For a long body, its size and SHA-256."""
    request_id: str | None = None
    count: Annotated[int, Field(ge=1)] = 1
    """Number of requests: frequent repeats by one client are counted together for a minute."""


class AuditEntry(AuditNote):
    """One row of the log. `number` grows with each row."""

    number: int
