"""Tells plug-ins what a command on the service's own computer changes, beside the service."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy.orm import Session

from daq.contracts.service.audit import AuditNote
from daq.plugins import named, plugins


def note_command(
    session: Session, at: datetime, by: str, action: str, command: str, subject: str, detail: str = ""
) -> None:
    """Tells plug-ins, within the transaction that makes the change. `by`: who does it."""
    said = {"actor": by, "action": action, "request": command, "subject": subject, "detail": detail}
    note = AuditNote(at=at, origin="command line", outcome="done", **said)
    for plugin in plugins():
        for reference in plugin.noted:
            named(reference)(session, note)
