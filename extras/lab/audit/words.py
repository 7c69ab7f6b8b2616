"""Prepares content of a request for the log: without secrets, limited in size, and valid in every database."""

from __future__ import annotations

import json
import re
from typing import Any

from daq.contracts.service.audit import AuditNote

LONGEST_LINE = 600
"""Length of a URL or a reason in the log."""
HIDDEN = "(not in the log)"
_SECRET_NAME = re.compile(
    r"token|secret|password|lease|ticket|credential|assertion|verifier|^code$|api_?key", re.IGNORECASE
)
_SECRET = re.compile(r"daq_[\w-]{16,}|whsec_[\w+/=-]+|eyJ[\w-]+\.[\w-]+\.[\w-]*|(?i:bearer|basic)\s+[\w.~+/=-]{8,}")
"""Tokens of this service, secrets of webhooks, JSON Web Tokens and headers with them, anywhere in a text."""


def line_of(text: object) -> str:
    """Returns a text in one line without secrets, of at most LONGEST_LINE characters."""
    whole = _SECRET.sub(HIDDEN, str(text))
    shown = "".join(
        sign if sign.isprintable() else sign.encode("unicode_escape", "backslashreplace").decode() for sign in whole
    )
    return shown if len(shown) <= LONGEST_LINE else shown[: LONGEST_LINE - 1] + "…"


def cleaned(note: AuditNote) -> AuditNote:
    """Returns a note with texts that may be in the log."""
    short = {name: line_of(said)[:200] for name in ("actor", "origin", "subject") if (said := getattr(note, name))}
    return note.model_copy(update={**short, "request": line_of(note.request), "detail": line_of(note.detail)})


def content_of(body: bytes) -> str | None:
    """Returns the content of a JSON body, as JSON without secrets; None if it is not JSON."""
    try:
        return json.dumps(_without_secrets(json.loads(body)), sort_keys=True, separators=(",", ":"))
    except (ValueError, RecursionError):
        return None


def _without_secrets(said: Any) -> Any:
    if isinstance(said, dict):
        return {
            _SECRET.sub(HIDDEN, name): HIDDEN
            if _SECRET_NAME.search(name) and value is not None
            else _without_secrets(value)
            for name, value in said.items()
        }
    if isinstance(said, list):
        return [_without_secrets(one) for one in said]
    return _SECRET.sub(HIDDEN, said) if isinstance(said, str) else said
