"""Notes the start of the service, and which sections of its configuration have changed since the last one."""

from __future__ import annotations

import hashlib
import json
from datetime import datetime
from importlib.metadata import version
from typing import Any

from pydantic import BaseModel

from daq.config.section import Section
from daq.config.settings import Settings
from daq.contracts.service.audit import AuditNote
from extras.lab.audit.log import AuditLog
from server.store.address import address_of, masked

STARTED = "start_service"


def begun(settings: Settings, audit: AuditLog, now: datetime) -> AuditNote:
    """Returns a note of the start, with a digest of each section of the configuration. A digest tells whether two are
    the same, and no word of either."""
    sections = _digests(settings)
    before = audit.newest(STARTED)
    known = json.loads(before.content or "{}").get("configuration", {}) if before is not None else sections
    changed = sorted(name for name in sections.keys() | known.keys() if sections.get(name) != known.get(name))
    said = {"version": version("ma2000-daq"), "configuration": sections}
    return AuditNote(
        at=now,
        origin="service",
        action=STARTED,
        outcome="done",
        detail=f"configuration changed: {', '.join(changed)}" if changed else "",
        content=json.dumps(said, sort_keys=True, separators=(",", ":")),
    )


def _digests(settings: Settings) -> dict[str, str]:
    found = {}
    for name in type(settings).model_fields:
        value = getattr(settings, name)
        if isinstance(value, Section):
            said: Any = value.digested()
        else:
            said = value.model_dump(mode="json") if isinstance(value, BaseModel) else value
        if name == "server":
            # Without its password, which somebody could guess and try against the digest.
            said |= {"database": masked(address_of(settings.server))}
        text = json.dumps(said, sort_keys=True, default=_plain)
        found[name] = hashlib.sha256(text.encode()).hexdigest()[:16]
    return found


def _plain(value: object) -> object:
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else str(value)
