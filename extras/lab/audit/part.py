"""The audit log of a running service: turns events into rows, and lists them.

It notes the start of the service, and which sections of its configuration have changed since the last start. No route
changes or deletes a row.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from datetime import datetime
from importlib.metadata import version
from typing import Annotated, Any

from fastapi import Query
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from pydantic import BaseModel
from starlette.types import Scope

from daq.config.section import Section
from daq.config.settings import Settings
from daq.contracts.service.audit import AuditEntry, AuditNote, Outcome
from daq.contracts.service.base import Moment, Page
from extras.lab.audit.log import AuditLog, AuditSearch
from extras.lab.audit.request import AskedRequest, asked_request
from extras.lab.audit.words import cleaned
from extras.lab.audit.writer import AuditWriter
from server.api.dependencies import CursorOf, Limit, Operator, part
from server.parts import Part
from server.problems import PROBLEMS
from server.routes import Router
from server.services import Services

STARTED = "start_service"


def begun(settings: Settings, audit: AuditLog, now: datetime) -> AuditNote:
    """Returns a note of the start, with a digest of each section of the configuration.

    A digest shows whether two are equal, but nothing of their content.
    """
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
        text = json.dumps(said, sort_keys=True, default=_plain)
        found[name] = hashlib.sha256(text.encode()).hexdigest()[:16]
    return found


def _plain(value: object) -> object:
    return value.model_dump(mode="json") if isinstance(value, BaseModel) else str(value)


class AuditPart(Part, Collector):
    """Writes rows, and reports the number of waiting ones to Prometheus."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self.log = AuditLog(services.store)
        self.writer = AuditWriter(self.log)

    def robots_made(self, robots: Sequence[Any]) -> None:
        """Notes the start, and changes of the configuration."""
        del robots
        self.writer.note(begun(self._services.settings, self.log, self._services.clock.utc()))

    def watch(self, scope: Scope, *, with_content: bool) -> AskedRequest | None:
        """Watches a request that may change something."""
        return asked_request(self.writer, self._services.clock.utc, scope, with_content=with_content)

    def acted(self, note: AuditNote, *, again: bool = False) -> None:
        """Writes events other than requests."""
        (self.writer.count if again else self.writer.note)(cleaned(note))

    def checks(self) -> dict[str, str]:
        """Returns why rows cannot be written."""
        return {"audit": self.writer.trouble}

    def close(self, seconds: float) -> None:
        """Writes the last rows."""
        self.writer.close(seconds)

    def describe(self) -> Iterable[Metric]:
        """Returns nothing: values are computed when Prometheus requests them."""
        return ()

    def collect(self) -> Iterable[Metric]:
        """Returns the numbers of written and of waiting rows."""
        written = CounterMetricFamily("daq_audit_rows", "Rows of the audit log written since the service started.")
        written.add_metric((), self.writer.written)
        yield written
        yield GaugeMetricFamily("daq_audit_waiting", "Rows of the audit log not written yet.", self.writer.waiting)


router = Router(tags=["system"], responses=PROBLEMS)
FLUSHED_WITHIN = 1.0
"""Time (s) to write waiting rows, so that a list includes the requests before it."""


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
    since: Annotated[Moment | None, Query(description="Only rows from this time on.")] = None,
    until: Annotated[Moment | None, Query(description="Only rows before this time.")] = None,
    limit: Limit = 50,
    cursor: CursorOf = None,
) -> Page[AuditEntry]:
    """Lists who requested which change, from where, and its outcome, the newest first. Needs the role operator.

    Nothing changes or deletes a row.
    """
    audit.writer.flush(FLUSHED_WITHIN)
    search = AuditSearch(actor, robot, action, subject, outcome, since, until)
    return audit.log.page(search, cursor, limit)
