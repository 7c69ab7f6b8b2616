"""The audit log, to be read. No route changes or deletes a row."""

from __future__ import annotations

from typing import Annotated

from fastapi import Query

from daq.contracts.service.audit import AuditEntry, Outcome
from daq.contracts.service.base import Moment, Page
from extras.lab.audit.log import AuditSearch
from extras.lab.audit.part import AuditPart
from server.api.dependencies import CursorOf, Limit, Operator, part
from server.problems import PROBLEMS
from server.routes import Router

router = Router(tags=["system"], responses=PROBLEMS)
FLUSHED_WITHIN = 1.0
"""Time (s) to write the rows that wait, so that a list has what was asked before it."""


def _equals(what: str, longest: int = 200) -> object:
    return Query(max_length=longest, description=f"Only rows with this {what}.")


@router.get("/audit")
def list_audit(
    audit: Annotated[AuditPart, part(AuditPart)],
    _: Operator,
    actor: Annotated[str | None, _equals("name of a token")] = None,
    robot: Annotated[str | None, _equals("robot")] = None,
    action: Annotated[str | None, _equals("action", 64)] = None,
    subject: Annotated[str | None, _equals("subject")] = None,
    outcome: Annotated[Outcome | None, Query(description="Only rows with this outcome.")] = None,
    since: Annotated[Moment | None, Query(description="Only rows from this moment on.")] = None,
    until: Annotated[Moment | None, Query(description="Only rows before this moment.")] = None,
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[AuditEntry]:
    """Lists who asked for which change, from where, and what became of it, the newest first. Needs the role operator.

    Nothing changes or deletes a row. `daq audit verify` checks the chain of their digests.
    """
    audit.writer.flush(FLUSHED_WITHIN)
    search = AuditSearch(actor, robot, action, subject, outcome, since, until)
    return audit.log.page(search, cursor, limit)
