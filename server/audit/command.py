"""Notes what is done by a command on the service's own computer, beside the service."""

from __future__ import annotations

import getpass
from datetime import datetime

from daq.contracts.service.audit import AuditNote
from server.audit.words import line_of


def computers_user() -> str:
    """Returns the name of the user who runs this program; their number, if they have no name here."""
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return "unknown"


def by_command(at: datetime, actor: str, action: str, command: str, subject: str, detail: str = "") -> AuditNote:
    """Returns the note of a command that was carried out."""
    return AuditNote(
        at=at,
        actor=line_of(actor)[:200],
        origin="command line",
        action=action,
        request=line_of(command),
        subject=line_of(subject)[:200],
        outcome="done",
        detail=line_of(detail),
    )
