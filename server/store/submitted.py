"""What experiments and jobs have in common: a request with the same key is submitted once, however often it is sent."""

from __future__ import annotations

import hashlib
import secrets
from datetime import datetime
from typing import Any, TypeVar

from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from server.problems import conflict
from server.store.tables import ExperimentRow, JobRow

Row = TypeVar("Row", ExperimentRow, JobRow)


def digest_of(request: BaseModel) -> str:
    """Returns a digest that tells whether two requests with one key are the same."""
    return hashlib.sha256(request.model_dump_json().encode()).hexdigest()


def made_before(session: Session, table: type[Row], robot: str, key: str | None, digest: str) -> Row | None:
    """Returns what this key made before, or None. Raises a 409 if the key was used for another request."""
    if key is None:
        return None
    found = session.scalar(select(table).filter_by(robot=robot, idempotency_key=key))
    if found is not None and found.request_digest != digest:
        line = f"Idempotency-Key {key!r} was used for another request"
        raise conflict("idempotency-key", line, "use a new key for a new request")
    return found


def new_columns(robot: str, key: str | None, digest: str, now: datetime, by: str) -> dict[str, Any]:
    """Returns the columns that a new experiment and a new job have in common."""
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
