"""Exit codes of all programs of this project (docs/command-line.md explains each)."""

from __future__ import annotations

from typing import Final

COMPLETE: Final = 0
PROGRAM_FAULT: Final = 1
WRONG_INPUT: Final = 2
NOT_REACHED: Final = 3
"""The robot or the service was not reached, or did not confirm the request."""
REFUSED: Final = 4
"""Refused for safety; nothing moved."""
FAULT: Final = 5
"""The run ended in a fault, or data cannot be trusted."""
STOPPED: Final = 6
INTERRUPTED: Final = 130
"""Exit code that shells report for a process ended by Ctrl-C."""

OF_OUTCOME: Final[dict[str, int]] = {"complete": COMPLETE, "fault": FAULT, "interrupted": FAULT, "stopped": STOPPED}
"""Exit code for each outcome of a run that left a trace."""
