"""What a line carries: bytes of a turn as the frames have them, the rate that leaves room, and what is told."""

import pytest

from daq.driver.line_rate import (
    LARGEST_SHARE,
    LineRate,
    bound_ms,
    bytes_of_a_compact_turn,
    bytes_of_a_snapshot,
    bytes_of_a_turn,
    line_rate,
    stop_latency_s,
    told_rates,
)
from firmware_protocol import commands as c
from firmware_protocol.framing import encode_frame

PERIOD = 0.020


def on_the_line(*messages: c.Message) -> int:
    return sum(len(encode_frame(c.to_frame(0, message))) for message in messages)


@pytest.mark.parametrize("joints", range(1, 7))
@pytest.mark.parametrize("moving", range(7))
def test_bytes_are_those_of_the_frames(joints: int, moving: int) -> None:
    postures = tuple((joint, 500) for joint in range(1, moving + 1))
    mask = (1 << joints) - 1
    snapshot = c.Snapshot(1, 0, tuple((joint, c.JointReading(1, 1, 1, 1)) for joint in range(1, joints + 1)))
    compact = c.CompactSnapshot(1, 0, 0, tuple((joint, c.CompactReading(1, 1, 1)) for joint in range(1, joints + 1)))
    written = on_the_line(c.WriteSetPoints(postures), c.SetPointsTaken(1, 0)) if moving else 0
    assert bytes_of_a_turn(joints, moving) == on_the_line(c.Sample(1, mask), snapshot) + written
    assert bytes_of_a_compact_turn(joints, moving) == on_the_line(c.MoveAndSample(1, mask, postures), compact)
    assert bytes_of_a_snapshot(joints, compact=False) == on_the_line(snapshot)
    assert bytes_of_a_snapshot(joints, compact=True) == on_the_line(compact)


@pytest.mark.parametrize(
    ("baud", "joints", "plain", "compact"),
    [(9600, 3, 6, 4), (9600, 6, 8, 5), (19200, 3, 3, 2), (19200, 6, 4, 3), (38400, 3, 2, 1), (57600, 6, 2, 1)],
)
def test_every_so_many_periods_there_is_a_sample(baud: int, joints: int, plain: int, compact: int) -> None:
    assert line_rate(baud / 10, PERIOD, joints, joints).every == plain
    assert line_rate(baud / 10, PERIOD, joints, joints, can_be_compact=True).every == compact


@pytest.mark.parametrize("baud", [1200, 9600, 19200, 38400, 57600, 115200])
@pytest.mark.parametrize("joints", range(1, 7))
@pytest.mark.parametrize("compact", [False, True])
def test_no_rate_takes_more_of_the_line_than_may_be_taken_and_none_faster_would_fit(
    baud: int, joints: int, compact: bool
) -> None:
    rate = line_rate(baud / 10, PERIOD, joints, joints, can_be_compact=compact)
    assert rate.share <= LARGEST_SHARE + 1e-9
    assert rate.every == 1 or rate.share * rate.every / (rate.every - 1) > LARGEST_SHARE


def test_a_rate_is_told_with_its_joints_share_and_stop() -> None:
    words = line_rate(1920, PERIOD, 3, 3, can_be_compact=True).in_words
    assert words == (
        "25 samples per second of 3 joints, every 2nd control period, 74 % of the line; a stop takes up to 45 ms"
    )
    assert line_rate(11520, PERIOD, 1, 1).in_words.startswith("50 samples per second of 1 joint, every control period")


def test_a_stop_waits_for_a_frame_of_the_largest_size() -> None:
    longest = on_the_line(c.WriteBlock(0xFC00, bytes(c.MAX_WRITE)), c.Stop())
    assert stop_latency_s(1920) == pytest.approx(longest / 1920 + 0.010)


@pytest.mark.parametrize(
    ("ending", "numbers"),
    [("st", (21,)), ("nd", (2, 22)), ("rd", (3, 23)), ("th", (4, 10, 11, 12, 13, 20, 24, 110, 112, 120))],
)
def test_every_nth_period_is_written_as_english_writes_it(ending: str, numbers: tuple[int, ...]) -> None:
    for every in numbers:
        words = LineRate(3, 3, every, 0.5, PERIOD, 0.0).in_words
        assert f", every {every}{ending} control period, 50 % of the line; " in words


def test_the_longest_time_of_a_stop_is_told_in_milliseconds_that_it_does_not_exceed() -> None:
    assert [bound_ms(s) for s in (0.0, 0.0449999, 0.045, 0.0450001, 0.0450021)] == [0, 45, 45, 46, 46]


def test_a_stop_takes_the_bridge_ten_milliseconds_beside_its_time_on_the_line() -> None:
    assert stop_latency_s(1e12) == pytest.approx(0.010)


def test_rates_are_told_for_one_joint_for_the_major_axes_and_for_all() -> None:
    found = told_rates(1920, PERIOD, can_be_compact=True)
    assert [(rate.joints, rate.moving) for rate in found] == [(1, 1), (3, 3), (6, 6)]
    assert found == tuple(line_rate(1920, PERIOD, joints, joints, can_be_compact=True) for joints in (1, 3, 6))
    assert [rate.compact for rate in told_rates(1920, PERIOD, can_be_compact=False)] == [False] * 3


def test_a_turn_without_set_points_is_never_compact() -> None:
    assert not line_rate(960, PERIOD, 6, 0, can_be_compact=True).compact
    assert line_rate(960, PERIOD, 6, 1, can_be_compact=True).compact


def test_a_line_of_which_samples_take_the_largest_share_gives_one_in_every_period() -> None:
    exactly = bytes_of_a_turn(3, 3) / (LARGEST_SHARE * PERIOD)
    assert [line_rate(exactly * more, PERIOD, 3, 3, can_be_compact=True).compact for more in (0.99, 1.01)] == [
        True,
        False,
    ]
    assert [line_rate(exactly * more, PERIOD, 3, 3).every for more in (0.99, 1.01)] == [2, 1]
    assert LARGEST_SHARE == 0.8
