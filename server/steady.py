"""What keeps the service's event loop, and the process that keeps time, from being held up by the interpreter."""

from __future__ import annotations

import gc
import sys

SWITCH_EVERY = 0.001
"""s that a thread computes before another one has its turn. Python's own 5 ms are what the event loop would wait for
each time that it has let go of the interpreter beside a thread that reads the database or checks a motion."""


def keep_steady() -> None:
    """Called when everything is loaded. A full garbage collection would look through all of it, for a tenth of a second
    during which nothing else runs: what is there now stays there, so it is taken out of what is looked through."""
    sys.setswitchinterval(SWITCH_EVERY)
    gc.collect()
    gc.freeze()
