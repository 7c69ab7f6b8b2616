"""The audit log of a running service: what it hears of becomes rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.types import Scope

from daq.contracts.service.audit import AuditNote
from extras.lab.audit.configuration import begun
from extras.lab.audit.log import AuditLog
from extras.lab.audit.request import AskedRequest, asked_request
from extras.lab.audit.words import cleaned
from extras.lab.audit.writer import AuditWriter
from server.parts import Part
from server.services import Services

KEPT = "audit-waiting.jsonl"
"""File of the rows that could not be written before the service ended."""
KEEPING = 0.6
"""Share of the time for the end in which rows that could not be written are kept in that file."""


class AuditPart(Part, Collector):
    """Writes rows, and tells Prometheus how many wait."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self.log = AuditLog(services.store)
        self.writer = AuditWriter(self.log, services.folder / KEPT)

    def robots_made(self, robots: Sequence[Any]) -> None:
        """Notes the start, and what has changed in the configuration."""
        del robots
        self.writer.note(begun(self._services.settings, self.log, self._services.clock.utc()))

    def watch(self, scope: Scope, *, with_content: bool) -> AskedRequest | None:
        """Watches a request that may change something."""
        return asked_request(self.writer, self._services.clock.utc, scope, with_content=with_content)

    def acted(self, note: AuditNote, *, again: bool = False) -> None:
        """Writes what happened otherwise than by a request."""
        (self.writer.count if again else self.writer.note)(cleaned(note))

    def close(self, seconds: float) -> None:
        """Writes the last rows."""
        self.writer.close(seconds * (1 - KEEPING))

    def describe(self) -> Iterable[Metric]:
        """Returns nothing: what is collected is asked for when Prometheus asks."""
        return ()

    def collect(self) -> Iterable[Metric]:
        """Returns how many rows were written, and how many wait."""
        written = CounterMetricFamily("daq_audit_rows", "Rows of the audit log written since the service started.")
        written.add_metric((), self.writer.written)
        yield written
        yield GaugeMetricFamily("daq_audit_waiting", "Rows of the audit log not written yet.", self.writer.waiting)
