"""Common part of experiments and jobs: a request with the same key is submitted only once, however often it is sent.

Also approvals in the rows of experiments and schedules.
"""

from __future__ import annotations

import hashlib
import secrets
from datetime import datetime
from typing import Any, TypeVar

from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from daq.contracts.service.experiments import Approval
from server.experiments.review import Given
from server.problems import ProblemError, conflict
from server.store.tables import Approvable, ExperimentRow, JobRow


def approval_of(row: Approvable) -> Approval | None:
    """Returns a row's approval for clients."""
    if row.approved_by is None or row.approved is None:
        return None
    return Approval(by=row.approved_by, at=row.approved, as_owner=bool(row.approved_as_owner))


def given_to(row: Approvable) -> Given | None:
    """Returns a row's approval with the content to which it is bound."""
    if row.approved_by is None or row.approved_content is None:
        return None
    return Given(row.approved_content, row.approved_by, bool(row.approved_as_owner))


def approve(row: Approvable, given: Given, now: datetime) -> None:
    """Writes an approval into a row."""
    row.approved_content, row.approved_by, row.approved_as_owner = given.content, given.by, given.as_owner
    row.approved = now


def void(row: Approvable) -> str | None:
    """Removes a row's approval, and returns who had given it."""
    by = row.approved_by
    row.approved_content = row.approved_by = row.approved_as_owner = row.approved = None
    return by


def require_approvable(given: Given, content: str, authors: tuple[str, ...], what: str) -> None:
    """Raises a 403 for the caller's own experiment, and a 409 if `content` differs from what the caller has seen."""
    if given.by in authors:
        line = f"{what} was submitted or changed by {given.by}: somebody else must approve it"
        raise ProblemError(403, "own-experiment", line, "ask another operator, or an owner of the robot")
    if given.content != content:
        line = f"{what} is not what you have looked at: it, or the machine file, has changed"
        raise conflict("content-changed", line, "look at it again, then approve what it is now")


Row = TypeVar("Row", ExperimentRow, JobRow)


def digest_of(request: BaseModel) -> str:
    """Returns a digest to compare two requests with the same key."""
    return hashlib.sha256(request.model_dump_json().encode()).hexdigest()


def made_before(session: Session, table: type[Row], robot: str, key: str | None, digest: str) -> Row | None:
    """Returns the row made earlier with this key, or None. Raises a 409 if the key was used for another request."""
    if key is None:
        return None
    found = session.scalar(select(table).filter_by(robot=robot, idempotency_key=key))
    if found is not None and found.request_digest != digest:
        line = f"Idempotency-Key {key!r} was used for another request"
        raise conflict("idempotency-key", line, "use a new key for a new request")
    return found


def new_columns(robot: str, key: str | None, digest: str, now: datetime, by: str) -> dict[str, Any]:
    """Returns the common columns of a new experiment and a new job."""
    return {
        "id": secrets.token_hex(6),
        "robot": robot,
        "state": "queued",
        "idempotency_key": key,
        "request_digest": digest,
        "submitted": now,
        "submitted_by": by,
        "reason": "",
    }
