"""Set points that the computer sends late are told: the controller has then worked with the one before."""

from pathlib import Path

import pytest

from daq.contracts.trace import LATE_SET_POINTS
from daq.traces.verify import verify
from tests.daq.runner.rig import rig


def warnings(path: Path) -> list[str]:
    return [one.message for one in verify(path).findings if one.level == "warning" and one.check == "set_points"]


def test_a_set_point_that_was_sent_a_period_late_is_told_in_the_trace_and_by_verify(tmp_path: Path) -> None:
    with rig(tmp_path, "seed=1") as arm:
        in_time = arm.run()
        clock = arm.controller.clock
        # The computer is held up for a period, while set points change:
        arm.ears.at_sample = {
            len(arm.ears.rows) + 8: lambda: clock.sleep_until(clock.now() + 1.1 * arm.controller.period_s)
        }
        late = arm.run()
    assert (in_time.counters[LATE_SET_POINTS], warnings(in_time.trace)) == (0, [])
    assert late.counters[LATE_SET_POINTS] > 0
    assert late.outcome == "complete"
    assert f"{late.counters[LATE_SET_POINTS]:.0f} set points taken a period late" in warnings(late.trace)[0]
    assert late.counters["missed_set_points"] == 0, "the controller has taken whatever was there"
    assert any("taken a period late" in event.message for event in arm.ears.events if event.kind == "note")


@pytest.mark.parametrize("options", ["baud=19200", "no_sample=1"])
def test_where_not_every_period_has_a_sample_of_the_bridge_no_number_is_told(tmp_path: Path, options: str) -> None:
    with rig(tmp_path, f"seed=1&{options}") as arm:
        result = arm.run()
    assert result.outcome == "complete"
    assert LATE_SET_POINTS not in result.counters
    assert LATE_SET_POINTS not in arm.trace(result).record.counters
    assert warnings(result.trace) == []
