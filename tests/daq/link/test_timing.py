"""How long a reply may take, and how often a request is repeated: the numbers themselves."""

import pytest

from daq.link.timing import LinkTiming
from firmware_protocol.commands import Hello, ReadStatus, Request, Sample, Stop
from firmware_protocol.scale import LineScale

LINE = LinkTiming(bytes_per_second=11520.0, period_s=0.03)
FULL_FRAMES = 2 * 57


@pytest.mark.parametrize(
    ("request_", "beyond_the_line"), [(ReadStatus(), 0.025), (Stop(), 0.010), (Sample(7, 1), 0.025 + 0.03)]
)
def test_a_reply_may_take_its_time_on_the_line_and_a_margin_and_a_sample_a_period_more(
    request_: Request, beyond_the_line: float
) -> None:
    assert LINE.reply_timeout_s(request_, 100) == pytest.approx((100 + FULL_FRAMES) / 11520 + beyond_the_line)
    assert LinkTiming(float("inf"), 0.03).reply_timeout_s(request_, 100) == pytest.approx(beyond_the_line)


def test_a_greeting_and_a_stop_are_repeated_more_often_than_anything_else() -> None:
    assert [LINE.retries_of(request) for request in (ReadStatus(), Hello(2, 1), Stop())] == [8, 40, 50]
    patient = LinkTiming(11520.0, retries=60)
    assert [patient.retries_of(request) for request in (ReadStatus(), Hello(2, 1), Stop())] == [60, 60, 50]
    assert LinkTiming(11520.0).period_s == 0.020


def test_a_shared_wire_is_given_the_time_of_its_own_answers() -> None:
    shared = LineScale(turn_bytes=400, greeting_bytes=1000, half_duplex=True)
    line = LinkTiming(5760.0)
    assert line.shared_wire_s(ReadStatus(), shared) == pytest.approx(400 / 5760)
    assert line.shared_wire_s(Hello(2, 1), shared) == pytest.approx(1000 / 5760)
    assert line.shared_wire_s(Hello(2, 1), LineScale(turn_bytes=400)) == 0.0
    assert line.reply_timeout_s(Stop(), 30) + line.shared_wire_s(Stop(), shared) > 0.020
