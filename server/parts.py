"""What a plug-in does in a running service."""

from __future__ import annotations


class Part:
    """A part of the service that a plug-in adds: `Plugin.parts` names the class. It is made with the `Services`, before
    they start, and found again as `services.part(Class)`. It overrides what it needs of the following."""

    def start(self) -> None:
        """Begins; the database is up to date, and the robots are there."""

    def close(self, seconds: float) -> None:
        """Ends within this time. Nothing else of the service runs any more but the log and the database."""
        del seconds

    def warnings(self) -> list[str]:
        """Returns what will need somebody soon, one line each."""
        return []
