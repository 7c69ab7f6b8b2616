"""What the driver says when a controller is not what it should be, and when a link fails under it."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from daq.driver import Controller, GainsNotTakenError, NoSampleError, ProtocolVersionError
from daq.link import Link, LinkTimeoutError
from daq.transport import TransportError
from firmware_protocol.commands import (
    Capability,
    Gains,
    GainsSet,
    Hello,
    HelloReply,
    Refusal,
    Refused,
    Reply,
    ReportGains,
    Request,
    Sample,
    SetGains,
    SetPointsTaken,
    Snapshot,
    Status,
    StatusFlag,
    Stop,
    Stopped,
    WriteSetPoints,
)
from firmware_protocol.joints import JointReading
from tests.daq.link.scripted import frame_of, scripted_link

HELLO = HelloReply(2, Capability.SAMPLE, 20_000, 8, 3, 0, 7)


def controller_that(answers: Callable[[Request], Reply | None], hello: HelloReply = HELLO) -> Controller:
    """A driver over a script; `answers` None is silence."""

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        reply = hello if isinstance(request, Hello) else answers(request)
        return [] if reply is None else [(0.001, frame_of(sequence, reply))]

    link, _ = scripted_link(answer)
    return Controller(link)


def test_another_protocol_is_refused_with_both_versions() -> None:
    newer = HelloReply(3, Capability.SAMPLE, 20_000, 8, 1)
    with pytest.raises(ProtocolVersionError, match="speaks protocol 3, this software 2: update this software"):
        controller_that(lambda _: None, newer)


def test_a_controller_that_cannot_be_spoken_to_is_not_kept_connected(monkeypatch: pytest.MonkeyPatch) -> None:
    def newer(sequence: int, _: Request) -> list[tuple[float, bytes]]:
        return [(0.0, frame_of(sequence, HelloReply(3, Capability.SAMPLE, 20_000, 8, 1)))]

    link, channel = scripted_link(newer)
    monkeypatch.setattr(Link, "open", lambda _url: link)
    with pytest.raises(ProtocolVersionError):
        Controller.connect("script://")
    assert channel.broken == "closed"


def test_a_recorded_short_greeting_of_the_same_version_is_no_identity() -> None:
    short = HelloReply(2, Capability.SIMULATED, 1_000, 8, 9)
    replies = iter([short, None])

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        assert isinstance(request, Hello)
        own = HelloReply(2, Capability.SAMPLE, 20_000, 8, 3, request.nonce, 7)
        return [(0.001, frame_of(sequence, next(replies, None) or own))]

    link, _ = scripted_link(answer)
    controller = Controller(link)
    assert (controller.identity.boots, controller.identity.simulated) == (3, False)
    assert controller.counters.stale == 1, "dropped, counted, and asked again"


def test_a_bridge_of_version_1_is_refused_in_one_line_and_can_be_stopped_all_the_same() -> None:
    stopped = Stopped(7, (500,) * 6)

    def version_1(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        reply = stopped if isinstance(request, Stop) else Refused(request.OPCODE, Refusal.BAD_LENGTH)
        return [(0.001, frame_of(sequence, reply))]

    link, _ = scripted_link(version_1)
    with pytest.raises(ProtocolVersionError, match="protocol 1, this software 2: update the controller's bridge"):
        Controller(link)
    assert link.stop() == stopped


def test_a_controller_in_lock_step_must_be_named_so() -> None:
    lock_step = HelloReply(2, Capability.LOCK_STEP, 20_000, 0, 1, 0, 7)
    with pytest.raises(TransportError, match=r"runs in lock-step: add \?lock_step=1 to the URL"):
        controller_that(lambda _: None, lock_step)


def test_gains_that_read_back_otherwise_are_reported() -> None:
    def answers(request: Request) -> Reply:
        return GainsSet() if isinstance(request, SetGains) else Gains(((2, 0, 0),) * 6)

    with pytest.raises(GainsNotTakenError, match=r"joint 3: gains \(4, 1, 0\) written, \(2, 0, 0\) read back"):
        controller_that(answers).set_gains(3, 4, 1, 0)


def test_gains_are_named_by_joint() -> None:
    gains = tuple((joint, 0, 1) for joint in range(1, 7))
    controller = controller_that(lambda request: Gains(gains) if isinstance(request, ReportGains) else None)
    assert controller.gains()[4] == (4, 0, 1)


def test_a_sample_older_than_asked_for_is_not_delivered() -> None:
    old = Snapshot(7, 0, ((1, JointReading(500, 2048, 0, 0)),))
    controller = controller_that(lambda request: old if isinstance(request, Sample) else Status(7, 0, 3, 0, 0))
    with pytest.raises(NoSampleError, match="sent tick 7, asked for one after 9"):
        controller.next_snapshot(after=9)


def test_a_stop_that_nobody_answers_is_told_and_not_raised() -> None:
    confirmation = controller_that(lambda _: None).stop()
    assert confirmation.sent
    assert not confirmation.acknowledged
    assert confirmation.frozen == {}
    assert confirmation.problem is not None
    assert "no reply to Stop" in confirmation.problem


def test_a_refused_stop_was_sent_and_is_not_confirmed() -> None:
    confirmation = controller_that(lambda request: Refused(request.OPCODE, Refusal.UNKNOWN_OPCODE)).stop()
    assert (confirmation.sent, confirmation.acknowledged) == (True, False)
    assert "refused Stop" in str(confirmation.problem)


def test_a_stop_over_an_ended_channel_was_not_sent() -> None:
    controller = controller_that(lambda _: None)
    controller.close()
    confirmation = controller.stop()
    assert (confirmation.sent, confirmation.acknowledged) == (False, False)


def test_a_silent_controller_is_a_time_out_whatever_was_asked() -> None:
    with pytest.raises(LinkTimeoutError, match="no reply to Sample"):
        controller_that(lambda request: None if isinstance(request, Sample) else Status(7, 0, 3, 0, 0)).next_snapshot()


def test_a_gap_in_the_ticks_is_counted_as_missing() -> None:
    later = Snapshot(15, 0, ((1, JointReading(500, 2048, 0, 0)),))
    controller = controller_that(lambda _: later)
    snapshot = controller.next_snapshot(after=10)
    assert snapshot.missing_before == 4
    assert controller.counters.missing_samples == 4


def snapshots_of(snapshot: Snapshot) -> Controller:
    """A driver over a board that takes set points in tick 7, and always delivers the same period."""
    taken, stopped = SetPointsTaken(7, 0), Stopped(7, (505,) * 6)
    replies: dict[type[Request], Reply] = {WriteSetPoints: taken, Sample: snapshot, Stop: stopped}
    return controller_that(lambda request: replies.get(type(request)))


def test_a_period_without_set_points_by_the_board_s_own_flag_is_told_though_none_were_sent() -> None:
    flagged = Snapshot(8, StatusFlag.SET_POINT_MISSED, ((1, JointReading(500, 2048, 0, 0)),))
    controller = snapshots_of(flagged)
    assert controller.next_snapshot().set_points_missed
    assert controller.counters.missed_set_points == 1


def test_a_period_that_shows_older_set_points_than_sent_is_told_without_a_flag() -> None:
    controller = snapshots_of(Snapshot(8, 0, ((1, JointReading(500, 2048, 0, 0)),)))
    assert not controller.next_snapshot().set_points_missed
    controller.set_points({1: 510})
    assert controller.next_snapshot().set_points_missed
    assert controller.counters.missed_set_points == 1


def test_set_points_of_before_a_new_greeting_are_not_missed_after_it() -> None:
    controller = snapshots_of(Snapshot(8, 0, ((1, JointReading(500, 2048, 0, 0)),)))
    controller.set_points({1: 510})
    controller.hello()
    assert not controller.next_snapshot().set_points_missed


def test_after_a_stop_the_period_after_it_must_show_the_frozen_set_points() -> None:
    assert not snapshots_of(Snapshot(7, 0, ((1, JointReading(500, 2048, 0, 0)),))).next_snapshot().set_points_missed
    controller = snapshots_of(Snapshot(8, 0, ((1, JointReading(500, 2048, 0, 0)),)))
    controller.set_points({1: 500})
    assert controller.stop().frozen == dict.fromkeys(range(1, 7), 505)
    assert controller.next_snapshot().set_points_missed


def test_only_a_greeting_after_a_reset_of_the_board_says_that_it_has_restarted() -> None:
    boots = iter([3, 3, 4])

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        assert isinstance(request, Hello)
        return [(0.0, frame_of(sequence, HelloReply(2, Capability.SAMPLE, 20_000, 8, next(boots), request.nonce, 7)))]

    link, _ = scripted_link(answer)
    controller = Controller(link)
    assert [controller.identity.restarted, controller.hello().restarted, controller.hello().restarted] == [
        False,
        False,
        True,
    ]
    assert controller.counters.restarts == 1
