"""A robot with a Python driver: nothing moves by surprise, a stop goes first and lasts, the unfit are refused."""

from __future__ import annotations

import math
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from daq.contracts.robot_driver import DriverError, DriverFacts, Positions, UnfitRobotError, require_fit
from daq.driver import Controller
from daq.link import Link, LinkTimeoutError, RequestRefusedError
from daq.link.driver_board import DriverBoard
from daq.link.driver_line import DriverLine
from daq.transport import PortBusyError
from firmware_protocol.commands import (
    Capability,
    ExplainedRefusal,
    FineSetPoints,
    Hello,
    HelloReply,
    Release,
    Released,
    ReportGains,
    Sample,
    SetPointsTaken,
    Snapshot,
    StatusFlag,
    Stop,
    Stopped,
)
from firmware_protocol.message import Reply, Request

FACTS = DriverFacts(
    joints=("pan", "tilt"),
    counts=4096,
    range_rad=math.tau,
    low_rad=-math.pi,
    measured=frozenset({"pan", "tilt"}),
    fresh="on request",
    holds=True,
    simulated=True,
)
MIDDLE = 2048


class Robot:
    """Two joints that go to their goals at the next reading, in counts from the middle. Time passes with each call."""

    def __init__(self, facts: DriverFacts = FACTS) -> None:
        self.facts = facts
        self.at = [100.0, -50.0]
        self.goals = list(self.at)
        self.calls: list[str] = []
        self.faults = 0
        """Readings that fail."""
        self.coasting = 0.0
        """Counts by which the first joint moves on at each reading."""
        self.sag = 0.0
        """Counts by which the first joint sinks while the drives are switched on."""
        self.time = 5.0
        self.reading = threading.Event()
        self.go_on = threading.Event()
        self.go_on.set()

    def connect(self) -> None:
        self.calls.append("connect")

    def read(self) -> Positions:
        self.reading.set()
        self.go_on.wait(10)
        self.time += 0.002
        if self.faults:
            self.faults -= 1
            raise OSError("no status packet")
        self.at = list(self.goals)
        self.at[0] += self.coasting
        self.goals[0] += self.coasting
        return Positions(tuple(math.tau * one / 4096 for one in self.at))

    def write(self, rad: Sequence[float]) -> Sequence[float]:
        self.goals = [one / math.tau * 4096 for one in rad]
        self.calls.append(f"write {[round(goal) for goal in self.goals]}")
        return rad

    def switch_on(self) -> None:
        self.calls.append("on")
        self.goals[0] -= self.sag

    def stop(self, rad: Sequence[float]) -> None:
        self.calls.append("stop")
        self.write(rad)

    def disconnect(self) -> None:
        self.calls.append("disconnect")

    def now(self) -> float:
        return self.time

    def sleep(self, seconds: float) -> None:
        self.time += seconds

    def board(self, *, stopped: bool = False) -> DriverBoard:
        return DriverBoard(self, self.now, self.sleep, stopped, lambda on: self.calls.append(f"kept {on}"))

    def line(self, folder: Path) -> DriverLine:
        return DriverLine("test:robot", self, state=folder / "state")


@pytest.fixture
def robot() -> Iterator[Robot]:
    made = Robot()
    yield made
    made.go_on.set()


def to(pan: int, tilt: int = -50) -> FineSetPoints:
    return FineSetPoints(((1, MIDDLE + pan), (2, MIDDLE + tilt)), 4096)


def why(reply: Reply) -> str:
    assert isinstance(reply, ExplainedRefusal)
    return reply.why


def test_what_is_only_looked_at_is_not_written_to(robot: Robot) -> None:
    board = robot.board()
    hello = board.answer(Hello(2, 7))
    assert isinstance(hello, HelloReply)
    assert Capability(hello.capabilities) == Capability.SAMPLE | Capability.POLLED | Capability.SIMULATED
    sample = board.answer(Sample(0, 3))
    assert isinstance(sample, Snapshot)
    assert [(one.set_point, one.position, one.error) for _, one in sample.joints] == [(2148, 2148, 0), (1998, 1998, 0)]
    assert sample.tick == 1, "a reading that took 2 ms, in its middle"
    assert "read, moved, stopped" in why(board.answer(ReportGains()))
    assert robot.calls == []


def test_drives_come_on_where_the_robot_is_and_before_the_first_set_point(robot: Robot) -> None:
    robot.sag = 7.0
    board = robot.board()
    assert isinstance(board.answer(to(110)), SetPointsTaken)
    assert robot.calls == ["write [100, -50]", "on", "write [93, -50]", "write [110, -50]"]
    assert isinstance(board.answer(to(120)), SetPointsTaken)
    assert robot.calls[4:] == ["write [120, -50]"]


def test_a_set_point_far_from_the_last_one_is_refused(robot: Robot) -> None:
    board = robot.board()
    assert why(board.answer(to(400))) == "joint 1 (pan): a step of 300 counts, up to 163 are sent"
    assert isinstance(board.answer(to(250)), SetPointsTaken)
    assert isinstance(board.answer(to(400)), SetPointsTaken)


def test_a_stop_is_confirmed_by_standing_still_and_lasts_until_its_own_release(robot: Robot) -> None:
    board = robot.board()
    board.answer(to(110))
    stopped = board.answer(Stop())
    assert isinstance(stopped, Stopped)
    assert stopped.postures == (2158, 1998)
    assert "until it is released" in why(board.answer(to(120)))
    assert "stop 1 is newer" in why(board.answer(Release(0)))
    assert robot.calls[-3:] == ["kept True", "stop", "write [110, -50]"]
    assert isinstance(board.answer(Release(1)), Released)
    assert robot.calls[-4:] == ["write [110, -50]", "on", "write [110, -50]", "kept False"]
    robot.coasting = 20.0
    assert "pan still moves: use the emergency stop" in why(board.answer(Stop()))
    assert "until it is released" in why(board.answer(to(120)))
    later = robot.board(stopped=True)
    assert "until it is released" in why(later.answer(to(120)))


@pytest.mark.parametrize(
    ("facts", "line"),
    [
        (replace(FACTS, holds=False), "does not hold its last set points"),
        (replace(FACTS, fresh=None), "old ones would pass for new"),
        (
            replace(FACTS, measured=frozenset({"pan"})),
            "tilt: no position is measured, so a stop could not",
        ),
        (replace(FACTS, joints=tuple("abcdefg")), "it has 7 joints, 1 to 6 are driven"),
    ],
)
def test_a_robot_that_safety_cannot_rely_on_is_refused(facts: DriverFacts, line: str) -> None:
    with pytest.raises(UnfitRobotError, match=line):
        require_fit("test:robot", facts)


def test_a_faulty_reading_is_repeated_and_silence_is_told_with_its_cause(robot: Robot, tmp_path: Path) -> None:
    with Controller(Link(line := robot.line(tmp_path), line)) as controller:
        robot.faults = 2
        assert controller.next_snapshot()[1].position == 2148
        assert controller.counters.retries >= 2
        robot.faults = 1000
        with pytest.raises(LinkTimeoutError, match="OSError: no status packet"):
            controller.next_snapshot()
    assert robot.calls == ["connect", "disconnect"]


def test_a_stop_overtakes_what_waits_for_the_robot_and_outlasts_the_connection(robot: Robot, tmp_path: Path) -> None:
    controller = Controller(Link(line := robot.line(tmp_path), line))
    controller.set_points({1: MIDDLE + 110})
    robot.go_on.clear()
    robot.reading.clear()
    outcomes: list[object] = []

    def attempt(request: Request) -> None:
        try:
            outcomes.append(controller.link.request(request, Reply))
        except RequestRefusedError as error:
            outcomes.append(error)

    threads = [threading.Thread(target=attempt, args=(request,)) for request in (Sample(0, 3), to(120), Stop())]
    threads[0].start()
    assert robot.reading.wait(10)
    for number, thread in enumerate(threads[1:], start=1):
        thread.start()
        with line._changed:
            line._changed.wait_for(lambda: len(line._asked) > number, 10)  # noqa: B023 - used at once
    robot.go_on.set()
    for thread in threads:
        thread.join()
    kinds = [type(one) for one in outcomes]
    assert RequestRefusedError in kinds, "the set points came after the stop"
    assert any(isinstance(one, Stopped) for one in outcomes)
    assert "write [120, -50]" not in robot.calls
    with pytest.raises(PortBusyError, match="another process"):
        robot.line(tmp_path).connect()
    controller.close()
    with Controller(Link(line := robot.line(tmp_path), line)) as later:
        status = later.status()
        assert StatusFlag.FROZEN in status.flags
        later.release(status.stop)
        later.set_points({1: MIDDLE + 112})


def test_a_stop_that_a_busy_driver_never_saw_is_found_by_the_next_connection(robot: Robot, tmp_path: Path) -> None:
    line = robot.line(tmp_path)
    line.connect()
    robot.go_on.clear()
    line.write(line.encode(1, Sample(0, 3)))
    assert robot.reading.wait(10)
    line.write(line.encode(2, Stop()))
    line.forget(2)
    closing = threading.Thread(target=line.close)
    closing.start()
    with line._changed:
        assert line._changed.wait_for(lambda: not line._open, 10)
    robot.go_on.set()
    closing.join()
    with Controller(Link(later := robot.line(tmp_path), later)) as controller:
        assert StatusFlag.FROZEN in controller.status().flags


def test_a_driver_that_cannot_connect_says_why(robot: Robot, tmp_path: Path) -> None:
    def connect() -> None:
        raise ConnectionError("no such\n port")

    robot.connect = connect  # type: ignore[method-assign]
    with pytest.raises(DriverError, match=r"the robot's driver failed: ConnectionError: no such port"):
        Link(line := robot.line(tmp_path), line)
