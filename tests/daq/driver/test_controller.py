"""What the driver says when a controller is not what it should be, and when a link fails under it."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from daq.driver import Controller, ControllerRestartedError, GainsNotTakenError, ProtocolVersionError
from daq.driver.line_rate import bytes_of_a_compact_turn, bytes_of_a_turn
from daq.link import Link, RequestRefusedError
from daq.transport import TransportError
from firmware_protocol import commands as c
from firmware_protocol.joints import JointReading
from firmware_protocol.message import Reply, Request
from tests.daq.link.scripted import ScriptedChannel, ScriptedEndpoint, Zeros, frame_of, says, scripted_link

HELLO = c.HelloReply(2, c.Capability.SAMPLE, 20_000, 8, 3, 0, 7)


def controller_that(answers: Callable[[Request], Reply | None], hello: c.HelloReply = HELLO) -> Controller:
    """A driver over a script; `answers` None is silence."""
    script = says(lambda request: hello if isinstance(request, c.Hello) else answers(request), 0.001)
    return Controller(scripted_link(script)[0])


def asked_of(
    answers: Callable[[Request], Reply | None], order: Callable[[Controller], object]
) -> tuple[list[Request], Any]:
    """What an order asks of a board that answers so, and what it gives."""
    asked: list[Request] = []
    controller = controller_that(lambda request: asked.append(request) or answers(request))  # type: ignore[func-returns-value]
    return asked, order(controller)


def test_a_controller_that_cannot_be_spoken_to_is_not_kept_connected(monkeypatch: pytest.MonkeyPatch) -> None:
    newer = c.HelloReply(3, c.Capability.SAMPLE, 20_000, 8, 1)
    with pytest.raises(ProtocolVersionError, match="speaks protocol 3, this software 2: update this software"):
        controller_that(lambda _: None, newer)
    lock_step = c.HelloReply(2, c.Capability.LOCK_STEP, 20_000, 0, 1, 0, 7)
    with pytest.raises(TransportError, match=r"runs in lock-step: add \?lock_step=1 to the URL"):
        controller_that(lambda _: None, lock_step)

    def newer(sequence: int, _: Request) -> list[tuple[float, bytes]]:
        return [(0.0, frame_of(sequence, c.HelloReply(3, c.Capability.SAMPLE, 20_000, 8, 1)))]

    link, channel = scripted_link(newer)
    monkeypatch.setattr(Link, "open", lambda _url: link)
    with pytest.raises(ProtocolVersionError):
        Controller.connect("script://")
    assert channel.broken == "closed"


def test_a_recorded_short_greeting_of_the_same_version_is_no_identity() -> None:
    short = c.HelloReply(2, c.Capability.SIMULATED, 1_000, 8, 9)
    replies = iter([short, None])

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        assert isinstance(request, c.Hello)
        own = c.HelloReply(2, c.Capability.SAMPLE, 20_000, 8, 3, request.nonce, 7)
        return [(0.001, frame_of(sequence, next(replies, None) or own))]

    link, _ = scripted_link(answer)
    controller = Controller(link)
    assert (controller.identity.boots, controller.identity.simulated) == (3, False)
    assert controller.counters.stale == 1, "dropped, counted, and asked again"


def test_a_bridge_of_version_1_is_refused_in_one_line_and_can_be_stopped_all_the_same() -> None:
    stopped = c.Stopped(7, (500,) * 6)

    def version_1(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        reply = stopped if isinstance(request, c.Stop) else c.Refused(request.OPCODE, c.Refusal.BAD_LENGTH)
        return [(0.001, frame_of(sequence, reply))]

    link, _ = scripted_link(version_1)
    with pytest.raises(ProtocolVersionError, match="protocol 1, this software 2: update the controller's bridge"):
        Controller(link)
    assert link.stop() == stopped


def test_gains_that_read_back_otherwise_are_reported() -> None:
    def answers(request: Request) -> Reply:
        return c.GainsSet() if isinstance(request, c.SetGains) else c.Gains(((2, 0, 0),) * 6)

    with pytest.raises(GainsNotTakenError, match=r"joint 3: gains \(4, 1, 0\) written, \(2, 0, 0\) read back"):
        controller_that(answers).set_gains(3, 4, 1, 0)


def snapshots_of(snapshot: c.Snapshot) -> Controller:
    """A driver over a board that takes set points in tick 7, and always delivers the same period."""
    taken, stopped = c.SetPointsTaken(7, 0), c.Stopped(7, (505,) * 6)
    replies: dict[type[Request], Reply] = {c.WriteSetPoints: taken, c.Sample: snapshot, c.Stop: stopped}
    return controller_that(lambda request: replies.get(type(request)))


def test_only_set_points_in_force_can_be_missed() -> None:
    flagged = c.Snapshot(8, c.StatusFlag.SET_POINT_MISSED, ((1, JointReading(500, 2048, 0, 0)),))
    controller = snapshots_of(flagged)
    assert controller.next_snapshot().set_points_missed
    assert controller.counters.missed_set_points == 1
    controller = snapshots_of(c.Snapshot(8, 0, ((1, JointReading(500, 2048, 0, 0)),)))
    controller.set_points({1: 510})
    controller.hello()
    assert not controller.next_snapshot().set_points_missed
    shown = c.Snapshot(8, 0, ((1, JointReading(500, 2048, 0, 0)),))
    refused = c.Refused(c.WriteSetPoints.OPCODE, c.Refusal.FROZEN)
    controller = controller_that(lambda request: refused if isinstance(request, c.WriteSetPoints) else shown)
    with pytest.raises(RequestRefusedError):
        controller.next_snapshot(set_points={1: 510})
    assert not controller.next_snapshot().set_points_missed


def test_only_a_greeting_after_a_reset_of_the_board_says_that_it_has_restarted() -> None:
    boots = iter([3, 3, 4])

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        assert isinstance(request, c.Hello)
        return [
            (0.0, frame_of(sequence, c.HelloReply(2, c.Capability.SAMPLE, 20_000, 8, next(boots), request.nonce, 7)))
        ]

    link, _ = scripted_link(answer)
    controller = Controller(link)
    assert [controller.identity.restarted, controller.hello().restarted, controller.hello().restarted] == [
        False,
        False,
        True,
    ]
    assert controller.counters.restarts == 1


def test_a_board_that_restarted_is_told_by_the_first_status_or_refusal() -> None:
    # A board without supply is told by the first status
    restarted = c.Status(7, c.StatusFlag.RESTARTED, 3, 0, 0)
    taken = c.SetPointsTaken(7, c.StatusFlag.RESTARTED)
    replies: dict[type[Request], Reply] = {c.ReadStatus: restarted, c.WriteSetPoints: taken}
    controller = controller_that(lambda request: replies.get(type(request)))
    with pytest.raises(ControllerRestartedError, match="gains are those of power-up"):
        controller.set_points({1: 500})
    # A sample that never comes from a board that restarted is a restart
    restarted = c.Status(7, c.StatusFlag.RESTARTED, 3, 0, 0)
    controller = controller_that(lambda request: restarted if isinstance(request, c.ReadStatus) else None)
    with pytest.raises(ControllerRestartedError):
        controller.next_snapshot(after=100)

    # What is refused since the board restarted is a restart and no refusal
    def answers(request: Request, status: int) -> Reply:
        if isinstance(request, c.ReadStatus):
            return c.Status(7, status, 3, 0, 0)
        return c.Refused(request.OPCODE, c.Refusal.BAD_SESSION)

    with pytest.raises(ControllerRestartedError):
        controller_that(lambda request: answers(request, c.StatusFlag.RESTARTED)).set_points({1: 500})
    with pytest.raises(RequestRefusedError, match="another host has taken control"):
        controller_that(lambda request: answers(request, 0)).set_points({1: 500})


def test_a_sample_is_asked_for_with_set_points_and_joints_or_as_the_next() -> None:
    shown = c.Snapshot(9, c.StatusFlag.FROZEN, ((2, JointReading(500, 2048, 0, 0)), (3, JointReading(501, 2052, 0, 0))))
    asked, found = asked_of(
        lambda request: c.SetPointsTaken(7, 0) if isinstance(request, c.WriteSetPoints) else shown,
        lambda controller: controller.next_snapshot(8, (2, 3), {3: 501, 2: 500}),
    )
    assert asked == [c.WriteSetPoints(((2, 500), (3, 501))), c.Sample(8, 0b110)]
    assert (found.tick, found.flags, found.missing_before) == (9, c.StatusFlag.FROZEN, 0)
    assert (found.set_points, found.consistent_by, found.tick_is_estimate) == ({2: 500, 3: 501}, "sample", False)
    assert not found.set_points_missed
    shown = c.Snapshot(9, 0, ((1, JointReading(500, 2048, 0, 0)),))
    asked, found = asked_of(lambda _: shown, Controller.next_snapshot)
    assert found.missing_before == 0
    assert asked == [c.Sample(c.AFTER_NEWEST, 0b111111)]
    reading = JointReading(500, 2048, 3, 6)
    shown = c.ErrorsPositionsPowers(((2, reading),))
    asked, found = asked_of(lambda _: shown, lambda controller: controller.errors_positions_powers((2,)))
    assert (asked, found) == ([c.ReportErrorsPositionsPowers(0b10)], {2: reading})


def test_a_stop_is_timed_to_its_own_confirmation_and_its_set_points_are_due_a_period_later() -> None:
    hello = c.HelloReply(2, c.Capability.SAMPLE, 20_000, 8, 3, 0, 7)

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        if isinstance(request, c.Hello):
            return [(0.0, frame_of(sequence, replace(hello, nonce=request.nonce)))]
        if isinstance(request, c.Stop):
            return [(0.004, frame_of(sequence, c.Stopped(7, (500,) * 6)))]
        return [(0.030, frame_of(sequence, c.Status(7, 0, 3, 0, 5)))]

    confirmation, number = Controller(scripted_link(answer)[0]).stop_numbered()
    assert (confirmation.seconds, number) == (pytest.approx(0.004), 5)
    # 505 from period 8 on; period 7 may still show the old ones
    for tick, missed in ((7, False), (8, True)):
        controller = snapshots_of(c.Snapshot(tick, 0, ((1, JointReading(500, 2048, 0, 0)),)))
        controller.set_points({1: 500})
        controller.stop()
        assert controller.next_snapshot().set_points_missed is missed


@pytest.mark.parametrize("reason", [c.Refusal.OTHER_STOP, c.Refusal.FROZEN])
def test_a_release_that_is_refused_for_another_reason_is_not_tried_again(reason: c.Refusal) -> None:
    controller = controller_that(
        lambda request: (
            c.Refused(c.Release.OPCODE, reason) if isinstance(request, c.Release) else c.Status(7, 0, 3, 0, 5)
        )
    )
    with pytest.raises(RequestRefusedError):
        controller.release(5)
    assert controller.counters.refused == 1


def test_what_a_stop_s_confirmation_tells() -> None:
    confirmation = controller_that(lambda _: c.Stopped(7, (1, 2, 3, 4, 5, 6))).stop()
    assert (confirmation.sent, confirmation.acknowledged, confirmation.tick) == (True, True, 7)
    assert confirmation.frozen == {1: 1, 2: 2, 3: 3, 4: 4, 5: 5, 6: 6}
    assert confirmation.problem is None
    confirmation = controller_that(lambda _: None).stop()
    assert confirmation.sent
    assert not confirmation.acknowledged
    assert confirmation.frozen == {}
    assert confirmation.problem is not None
    assert "no reply to Stop" in confirmation.problem
    confirmation = controller_that(lambda request: c.Refused(request.OPCODE, c.Refusal.UNKNOWN_OPCODE)).stop()
    assert (confirmation.sent, confirmation.acknowledged) == (True, False)
    assert "refused Stop" in str(confirmation.problem)
    controller = controller_that(lambda _: None)
    controller.close()
    confirmation = controller.stop()
    assert (confirmation.sent, confirmation.acknowledged) == (False, False)


def test_the_greeting_tells_the_link_how_long_a_sample_may_take() -> None:
    """A period of a second: the answer comes after 0.9 s, and is asked for once."""

    def answer(sequence: int, request: Request) -> list[tuple[float, bytes]]:
        slow = c.HelloReply(2, c.Capability.SAMPLE, 1_000_000, 8, 3, 0, 7)
        shown = c.Snapshot(7, 0, ((1, JointReading(500, 2048, 0, 0)),))
        return [
            (0.9, frame_of(sequence, shown)) if isinstance(request, c.Sample) else (0.001, frame_of(sequence, slow))
        ]

    link, channel = scripted_link(answer)
    assert Controller(link).next_snapshot().tick == 7
    assert [type(request) for _, request in channel.asked].count(c.Sample) == 1
    assert link.counters.timeouts == 0


def test_the_end_of_a_block_closes_the_line() -> None:
    link, channel = scripted_link(lambda sequence, _: [(0.001, frame_of(sequence, HELLO))])
    with Controller(link) as controller:
        assert channel.broken is None
    assert channel.broken == "closed"
    assert not controller.stop().sent


@pytest.mark.parametrize(
    ("capabilities", "together", "every", "compact"),
    [
        (c.Capability.SAMPLE | c.Capability.COMPACT, True, 4, True),
        (c.Capability.SAMPLE | c.Capability.COMPACT, False, 6, False),
        (c.Capability.SAMPLE, True, 6, False),
        (c.Capability.COMPACT, True, 1, True),
    ],
)
def test_a_slow_line_gives_a_sample_every_so_many_periods_where_the_bridge_sees_them(
    capabilities: c.Capability, together: bool, every: int, compact: bool
) -> None:
    """At 9600 baud. A memory that is read by the host gives one in every period, or none."""
    hello = c.HelloReply(2, capabilities, 20_000, 8, 3, 0, 7)
    channel = ScriptedChannel(lambda sequence, _: [(0.001, frame_of(sequence, hello))])
    endpoint = ScriptedEndpoint([channel], bytes_per_second=960.0)
    controller = Controller(Link(endpoint, now=channel.now, chance=Zeros()))
    rate = controller.line_rate((1, 2, 3), (1, 2, 3), together=together)
    assert (rate.joints, rate.moving, rate.every, rate.compact) == (3, 3, every, compact)
    turn = bytes_of_a_compact_turn(3, 3) if compact else bytes_of_a_turn(3, 3)
    assert rate.share * rate.every == pytest.approx(turn / 960.0 / 0.02)
    assert controller.line_rate((1, 2, 3)).moving == 0
    assert controller.line_rate().joints == 6
