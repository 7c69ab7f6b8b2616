"""The audit log: what was asked of the service, by whom, from where, and what became of it."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AwareDatetime, Field

from daq.contracts.service.base import Wire

Outcome = Literal["done", "refused", "failed"]
"""`refused`: nothing was changed, and the asker was told why. `failed`: the service could not carry it out."""
Digest = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


class AuditNote(Wire):
    """What was asked, before it has a place in the log."""

    at: AwareDatetime
    actor: str | None = None
    """The name of the asker's token, `local` for a user of the service's computer; None for an unknown asker."""
    role: str | None = None
    origin: str
    """Address of the asker's computer (that of the proxy, if there is one); `command line`, `service`."""
    action: str
    """What was asked: the name of the operation, as the API's description has it, or of the command."""
    request: str = ""
    """Method and address of the request, or the command."""
    robot: str | None = None
    subject: str | None = None
    """Number or name of what was made or changed."""
    outcome: Outcome
    status: int | None = None
    """Status of the answer (HTTP)."""
    detail: str = ""
    """Why it was refused, or what the arm answered."""
    content: str | None = None
    """What the request said: JSON without secrets; of a long one, its size and SHA-256."""
    request_id: str | None = None
    count: Annotated[int, Field(ge=1)] = 1
    """Number of requests: those that a client repeats all the time are counted for a minute."""


class AuditEntry(AuditNote):
    """One row of the log. `number` grows by 1 with each row."""

    number: int
    previous: Digest
    """The digest of the row before."""
    digest: Digest
    """SHA-256 of the row with `previous`, so that a change of any row shows in all later ones."""
