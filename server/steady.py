"""Settings of the interpreter that keep pauses of the event loop, and of the process that keeps time, short."""

from __future__ import annotations

import gc
import sys

SWITCH_EVERY = 0.001
"""Longest time (s) that a thread holds the interpreter while another one waits. With Python's default of 5 ms the event
loop would wait that long for every thread that reads the database or checks a motion."""


def keep_steady() -> None:
    """Freezes loaded objects out of garbage collection, where a full collection would pause everything for 0.1 s, and
    lets collections begin; and switches threads more often. Call this when everything is loaded."""
    sys.setswitchinterval(SWITCH_EVERY)
    gc.freeze()
    gc.enable()
