"""Tells a job that gets no processor from one that computes: both may say nothing new for a long time. Pure."""

from __future__ import annotations

from dataclasses import dataclass

from daq.contracts.processor import ProcessorTime
from server.jobs.mailbox import Reported

ASKED_AFTER = 10.0
"""Time (s) without news after which a person asks whether a job still goes on."""
WAITS = "waiting for the processor: the computer is busy"


@dataclass
class Standing:
    """The last news of a running job, when they came (s, monotonic), and the processor's time of its processes then."""

    reported: Reported | None
    since: float
    begun: ProcessorTime | None
    waits: bool = False

    def look(self, reported: Reported | None, now: float, time: ProcessorTime | None) -> None:
        """Takes the present state. A job waits if its processes have mostly waited for a processor since its last
        news, where those are older than ASKED_AFTER."""
        if reported != self.reported or self.begun is None or time is None:
            self.reported, self.since, self.begun, self.waits = reported, now, time, False
        elif now - self.since >= ASKED_AFTER:
            self.waits = time.waits_mostly_since(self.begun)
