"""The folder of a job: its request, its progress, its cancellation, its result. These are files, so that a worker on
another computer could share them; each is written completely or not at all."""

from __future__ import annotations

import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from daq.contracts.service.jobs import LeadingEffect
from daq.contracts.whole_file import replacing

TELL_EVERY = 0.2
"""Time (s) between two progress reports, and between two checks for cancellation."""
REQUEST, PROGRESS, CANCEL, RESULT, REPORT, MODEL = (
    "request.json",
    "progress.json",
    "cancel",
    "result.json",
    "report.html",
    "model.json",
)


@dataclass(frozen=True)
class Reported:
    """The progress of a job."""

    fraction: float
    text: str
    leading: tuple[LeadingEffect, ...] = ()


class Mailbox:
    """One job's folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._told = 0.0
        self._looked = 0.0
        self._cancelled = False
        self._now = Reported(0.0, "")

    def write(self, name: str, data: Any) -> None:
        """Writes a JSON file."""
        self.write_text(name, json.dumps(data, allow_nan=False))

    def write_text(self, name: str, text: str) -> None:
        """Writes a text file, completely or not at all."""
        with replacing(self.folder / name) as part:
            part.write_text(text, "utf-8")

    def read(self, name: str) -> Any:
        """Reads a JSON file; returns None if it does not exist."""
        try:
            return json.loads((self.folder / name).read_text("utf-8"))
        except FileNotFoundError:
            return None

    def cancel(self) -> None:
        """Requests that the job ends."""
        (self.folder / CANCEL).touch()

    def reported(self) -> Reported | None:
        """Returns the job's progress; None before it has begun."""
        data = self.read(PROGRESS)
        if data is None:
            return None
        return Reported(data["fraction"], data["text"], tuple(map(LeadingEffect.model_validate, data["leading"])))

    # ---- the worker's side

    def report(self, fraction: float, text: str, *, at_once: bool = False) -> None:
        """Reports progress, as `daq.contracts.progress.Progress`. Reports that follow too soon are dropped, unless
        `at_once` is set, for the start of a long stage."""
        now = time.monotonic()
        self._now = replace(self._now, fraction=fraction, text=text)
        if now - self._told < TELL_EVERY and not at_once:
            return
        self._told = now
        data = {"fraction": fraction, "text": text, "leading": [one.model_dump() for one in self._now.leading]}
        with replacing(self.folder / PROGRESS, synced=False) as part:
            part.write_text(json.dumps(data), "utf-8")

    def tell_leading(self, leading: tuple[LeadingEffect, ...]) -> None:
        """Reports the leading candidates at once."""
        self._now = replace(self._now, leading=leading)
        self.report(self._now.fraction, self._now.text, at_once=True)

    def is_set(self) -> bool:
        """Whether the job must end, as `daq.contracts.progress.Cancel`."""
        now = time.monotonic()
        if not self._cancelled and now - self._looked >= TELL_EVERY:
            self._looked = now
            self._cancelled = (self.folder / CANCEL).exists()
        return self._cancelled
