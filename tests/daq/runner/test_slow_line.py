"""A run over a slow line: every n-th period is recorded, and the trace says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.daq.runner.rig import rig


def test_a_run_on_a_slow_line_is_complete_and_says_at_what_rate(tmp_path: Path) -> None:
    with rig(tmp_path, "seed=5&baud=38400&no_compact=1") as arm:
        result = arm.run()
        trace = arm.trace(result)
    assert (result.outcome, result.missing, trace.missing) == ("complete", 0, 0)
    assert trace.record.every == 2
    assert trace.tick is not None
    assert set(np.diff(trace.tick)) == {2}
    (told,) = [event.message for event in trace.events if event.message.startswith("slow line")]
    assert told.startswith("slow line: 25 samples a second of 3 joints, every 2nd control period")


def test_a_trace_of_a_fast_line_says_nothing_of_its_rate(tmp_path: Path) -> None:
    with rig(tmp_path, "seed=5") as arm:
        trace = arm.trace(arm.run())
    assert trace.record.every == 1
    assert "every" not in trace.record.model_dump()
