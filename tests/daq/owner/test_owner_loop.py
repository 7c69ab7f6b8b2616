"""In the owner's process: a silent robot, a reset and the stops since, and reports that nobody reads."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from threading import Event
from types import SimpleNamespace
from typing import Any, cast

import pytest

from daq.contracts.errors import ReachError, SafetyError
from daq.contracts.machine import load_machine
from daq.driver import HardwareFaultError, NoSampleError
from daq.link import Link, LinkState
from daq.owner import long_orders, stop_socket
from daq.owner import speaker as module
from daq.owner.guardian import EndCause, Guardian
from daq.owner.loop import _watch, serve
from daq.owner.messages import BEGINS_WITHIN, REPORT, Answer, EventHappened, MoveGripper, Open, Reset, RunProgram
from daq.owner.owned_robot import OwnedRobot
from daq.owner.quick_orders import carry_out
from daq.owner.speaker import Speaker
from daq.owner.stop_socket import StopAnswer, request_stop, stop_listener
from daq.owner.watched_controller import WatchedController
from daq.runner.arm_control import ArmControl
from daq.safety import State
from firmware_protocol.commands import ReadStatus, Release, StatusFlag, Stop
from firmware_protocol.framing import Frame
from firmware_protocol.message import Request
from firmware_protocol.session import to_frame
from mock_controller.bridge.bridge import Bridge
from tests.mock.in_process import InProcess

SILENT = NoSampleError("mock://: no whole sample")


class SilentForAWhile:
    """A controller that gives a sample, then none twice while its line stays open, then samples again."""

    def __init__(self) -> None:
        self.link = SimpleNamespace(state=LinkState.CONNECTED, lock_step=True, url="mock://", stops=0)
        self.period_s = 0.0
        self.ticks = iter(range(1000))
        self.silence: Iterator[bool] = iter([False, True, True])

    def next_snapshot(self, _after: int | None = None) -> SimpleNamespace:
        if next(self.silence, False):
            raise SILENT
        return SimpleNamespace(tick=next(self.ticks), flags=StatusFlag(0))

    def line_rate(self) -> SimpleNamespace:
        return SimpleNamespace(every=1)

    def hello(self) -> None:
        """The greeting."""

    def status(self) -> SimpleNamespace:
        return SimpleNamespace(flags=StatusFlag(0))


class WithADamagedDrive(SilentForAWhile):
    """A controller that reports a damaged drive in place of these samples."""

    def __init__(self, *damaged: bool) -> None:
        super().__init__()
        self.silence = iter(())
        self.damaged = iter(damaged)
        self.greetings = self.stops = self.numbered = 0

    def number_stop(self) -> None:
        self.numbered += 1

    def next_snapshot(self, _after: int | None = None) -> SimpleNamespace:
        if next(self.damaged, False):
            raise HardwareFaultError("servo 2 reports overload")
        return super().next_snapshot()

    def hello(self) -> None:
        self.greetings += 1

    def stop(self) -> SimpleNamespace:
        self.stops += 1
        return SimpleNamespace(acknowledged=True)


def served(
    orders: dict[int, Any],
    turns: int = 8,
    activities: list[str] | None = None,
    anew: list[int] | None = None,
    controller: SilentForAWhile | None = None,
) -> tuple[list[str], list[Answer]]:
    """States of the arm as they are told, and answers; `orders` by the turn in which they come. `anew` gets how many
    answers there were whenever the state was told in any case."""
    controller, closing = controller or SilentForAWhile(), Event()
    states: list[str] = []
    answers: list[Answer] = []
    control = ArmControl(cast(Any, controller))
    numbers = iter(range(turns))

    def take(_timeout: float) -> Any:
        return orders.get(next(numbers))

    def report_arm(**told: bool) -> None:
        if anew is not None and told.get("anew"):
            anew.append(len(answers))
        states.append(str(control.arm.state))
        if activities is not None:
            activities.append(robot.activity)
        if len(states) >= turns:
            closing.set()

    robot = SimpleNamespace(
        opening=SimpleNamespace(watched=True),
        controller=controller,
        control=control,
        report_arm=report_arm,
        read_gains=dict,
        activity="none",
        guardian=SimpleNamespace(cause=None, is_older_than_stop=lambda _asked: False),
        number_stop=getattr(controller, "number_stop", lambda: None),
        end_cause=lambda: None,
        speaker=SimpleNamespace(ended=answers.append),
        inbox=SimpleNamespace(take=take, closing=closing, done=lambda: None),
    )
    serve(cast(Any, robot))
    return states, answers


def test_a_robot_that_answers_again_is_connected_again_and_a_damaged_drive_is_a_fault() -> None:
    states, _ = served({})
    assert states[:5] == ["idle", "disconnected", "disconnected", "idle", "idle"]
    controller = WithADamagedDrive(False, True, True, True)
    states, _ = served({}, controller=controller)
    assert states[:6] == ["idle", "fault", "fault", "fault", "fault", "fault"]
    assert (controller.stops, controller.greetings) == (1, 0)
    assert controller.numbered >= 3, "else nobody could release the stop while the drive is damaged"
    controller = WithADamagedDrive(False, True, True)
    controller.silence = iter([True])
    states, _ = served({}, controller=controller)
    assert states[:4] == ["disconnected", "idle", "fault", "fault"]


def test_nothing_moves_a_silent_robot_or_comes_late() -> None:
    # What would move a robot that is silent is refused
    order = cast(Any, RunProgram).model_construct(number=7, asked=time.monotonic(), activity="program")
    states, answers = served({2: order})
    assert [(a.number, a.exit_code) for a in answers] == [(7, ReachError.exit_code)]
    assert "the link is lost; the service tries to reconnect" in answers[0].problem
    assert states[-1] == "idle"
    # The process was put aside with the order in its pipe, and goes on when nobody expects it any more. Its
    # program is missing: a fault if it began
    late = time.monotonic() - BEGINS_WITHIN - 0.1
    order = cast(Any, RunProgram).model_construct(number=7, asked=late, activity="program")
    _, (answer,) = served({0: order})
    assert answer.exit_code == ReachError.exit_code
    assert "nothing was done" in answer.problem
    # The service has noted the stop by then, and lets nobody resume the queue until it is told of another
    # state
    told: list[int] = []
    _, answers = served({0: Reset(number=7, asked=time.monotonic(), stop=0, here=False)}, anew=told)
    assert [answer.number for answer in answers] == [7]
    assert told == [0]


@pytest.mark.parametrize("activity", ["program", "step"])
def test_what_is_carried_out_is_told_before_by_its_own_name(activity: str, monkeypatch: pytest.MonkeyPatch) -> None:
    order = cast(Any, RunProgram).model_construct(number=7, asked=time.monotonic(), activity=activity)
    activities: list[str] = []

    def perform(_robot: Any, order: RunProgram) -> Answer:
        assert activities[-1] == activity
        return Answer(number=order.number)

    monkeypatch.setattr(long_orders, "perform", perform)
    _, answers = served({0: order}, activities=activities)
    assert answers == [Answer(number=7)]
    assert activities[:2] == [activity, "none"]


# ---- In the owner's process: a reset ends the stop that its asker knew of, and none that has come since


class Interrupted(Bridge):
    """Something happens just before it hears the next request of a kind."""

    before: type[Request] | None = None
    happens: Callable[[], object]

    def receive(self, frame: Frame) -> list[Frame]:
        if self.before is not None and frame.opcode == self.before.OPCODE:
            self.before = None
            self.happens()
        return super().receive(frame)

    def hear_a_stop(self) -> None:
        super().receive(to_frame(0, Stop()))


@dataclass
class Scene:
    """An owner's robot, and a bridge that hears stops of others."""

    endpoint: InProcess
    guardian: Guardian
    control: ArmControl
    robot: OwnedRobot

    def press_stop(self) -> None:
        """On this computer: through the guardian."""
        (attempt,) = request_stop()
        assert attempt.answer is not None
        assert attempt.answer.confirmed

    def between(self, request: type[Request], happens: Callable[[], object]) -> None:
        """Before the next request of a kind reaches the bridge."""
        self.endpoint.bridge.happens, self.endpoint.bridge.before = happens, request

    def reset(self, *, here: bool, asked: float | None = None, stop: int | None = None) -> None:
        asked = time.monotonic() if asked is None else asked
        carry_out(
            self.robot, Reset(number=1, asked=asked, stop=self.newest_stop() if stop is None else stop, here=here)
        )

    def newest_stop(self) -> int:
        return int(self.endpoint.bridge._newest_stop)

    def is_stopped(self) -> bool:
        return bool(self.endpoint.board.frozen) and self.control.arm.state is State.STOPPED


@contextmanager
def owner_at(endpoint: InProcess) -> Iterator[Scene]:
    machine, controller = load_machine("ma2000"), WatchedController(Link(cast(Any, endpoint)))
    control = ArmControl(controller)

    def freeze(cause: str) -> StopAnswer:
        del cause
        endpoint.bridge.hear_a_stop()
        return StopAnswer(robot="arm", delivered=True, confirmed=True, tick=7)

    with stop_listener("arm") as listener, Guardian(listener, None, freeze) as guardian:
        unheard, no_inbox = Speaker(-1), cast(Any, None)
        opening = Open(url="wire", machine=machine, limits=machine.limits, folder=Path(), robot="arm", watched=True)
        robot = OwnedRobot(opening, controller, control, guardian, no_inbox, unheard)
        yield Scene(endpoint, guardian, control, robot)


@pytest.fixture
def scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Scene]:
    """The arm has been stopped for a reason that the asker of the reset knows."""
    monkeypatch.setenv(stop_socket.FOLDER_VARIABLE, str(tmp_path / "run"))
    with owner_at(InProcess(Interrupted, sample=True)) as made:
        made.control.stop("following error")
        assert made.is_stopped()
        yield made


@pytest.mark.parametrize("here", [False, True])
def test_a_reset_ends_the_stop_before_it(scene: Scene, here: bool) -> None:
    scene.press_stop()
    scene.reset(here=here)
    assert not scene.endpoint.board.frozen
    assert (scene.control.arm.state, scene.guardian.cause) == (State.IDLE, None)


@pytest.mark.parametrize("here", [False, True])
def test_a_stop_after_the_reset_was_asked_for_holds(scene: Scene, here: bool) -> None:
    """The owner came to the reset late: it was repeating another request on a bad line."""
    asked = time.monotonic()
    scene.press_stop()
    with pytest.raises(SafetyError, match=f"stopped after this request was sent .{EndCause.STOP.value}"):
        scene.reset(here=here, asked=asked)
    assert scene.is_stopped()
    assert scene.guardian.cause is EndCause.STOP
    scene.reset(here=here)
    assert not scene.endpoint.board.frozen


@pytest.mark.parametrize("here", [False, True])
@pytest.mark.parametrize("request_under_way", [ReadStatus, Release])
def test_a_stop_during_the_reset_holds(scene: Scene, here: bool, request_under_way: type[Request]) -> None:
    scene.between(request_under_way, scene.press_stop)
    with pytest.raises(SafetyError, match="try again"):
        scene.reset(here=here)
    assert scene.is_stopped()
    assert scene.guardian.cause is EndCause.STOP


def test_a_stop_just_before_the_one_of_a_reset_here_holds(scene: Scene) -> None:
    scene.between(Stop, scene.press_stop)
    with pytest.raises(SafetyError, match="stopped after this request was sent"):
        scene.reset(here=True)
    assert scene.is_stopped()
    assert scene.guardian.cause is EndCause.STOP


@pytest.mark.parametrize("here", [False, True])
def test_a_stop_of_another_computer_holds(scene: Scene, here: bool) -> None:
    scene.between(Release, scene.endpoint.bridge.hear_a_stop)
    with pytest.raises(SafetyError, match="stopped after this request was sent: look at it, then try again"):
        scene.reset(here=here)
    assert scene.is_stopped()
    assert scene.control.halted is not None
    scene.reset(here=here)
    assert not scene.endpoint.board.frozen


@pytest.mark.parametrize("here", [False, True])
def test_a_reset_ends_no_stop_that_its_sender_had_not_seen_whatever_time_it_names(scene: Scene, here: bool) -> None:
    """The service was so busy that the reset got the time at which it was read."""
    seen = scene.newest_stop()
    scene.press_stop()
    with pytest.raises(SafetyError, match="stopped after this request was sent"):
        scene.reset(here=here, stop=seen)
    assert scene.is_stopped()


def test_what_arrived_before_the_newest_stop_changes_nothing_after_its_reset(scene: Scene) -> None:
    asked = time.monotonic()
    scene.press_stop()
    scene.reset(here=False)
    late = MoveGripper(number=1, asked=asked, closed=True, while_stopped=True)
    with pytest.raises(SafetyError, match="gripper: the arm has been stopped after this request was sent"):
        carry_out(scene.robot, late)
    carry_out(scene.robot, late.model_copy(update={"asked": time.monotonic()}))


def test_a_stop_s_number_is_told_once_it_is_known_to_be_that_of_the_newest(scene: Scene) -> None:
    scene.robot.number_stop()
    assert scene.robot.newest_stop == scene.newest_stop()
    scene.press_stop()
    assert scene.robot.newest_stop is None
    scene.robot.number_stop()
    assert scene.robot.newest_stop == scene.newest_stop()


# ---- Reports never hold up a run

END = Answer(number=1, problem="the end", exit_code=5)


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    """Its two ends; the tests close the one that is read."""
    reader, writer = os.pipe()
    yield reader, writer
    os.close(writer)


def test_reports_come_out_in_order_and_a_reader_that_is_gone_is_no_error(pipe: tuple[int, int]) -> None:
    reader, writer = pipe
    with Speaker(writer) as speaker:
        speaker.progress(0.5, "half")
        speaker.ended(END)
    found = [REPORT.validate_json(line) for line in os.read(reader, 65536).splitlines()]
    os.close(reader)
    assert [report.kind for report in found] == ["progress", "answer"]
    with Speaker(writer) as speaker:
        for _ in range(10):
            speaker.progress(0.5, "unheard")
        speaker.ended(END)


def test_a_reader_that_does_not_read_costs_no_time(pipe: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = pipe
    monkeypatch.setattr(module, "WAITING_REPORTS", 50)
    text = "x" * 10_000
    with Speaker(writer) as speaker:
        for _ in range(200):  # 2 MB: no pipe takes that, nor do 50 waiting reports
            speaker.progress(0.5, text)
        assert speaker.dropped > 0
        with os.fdopen(reader, "rb") as heard:
            told = next(line for line in heard if b'"missing"' in line)
    assert isinstance(report := REPORT.validate_json(told), EventHappened)
    assert f"{speaker.dropped} reports" in report.event.message


def test_a_period_that_began_before_the_reset_is_no_new_stop(scene: Scene) -> None:
    """The board computes for a while in each period, and then tells whether it was stopped when the period began."""
    controller, board = scene.robot.controller, scene.endpoint.board
    begun = board.tick
    while board.tick == begun:
        controller.clock.sleep_until(controller.clock.now() + 1e-3)
    scene.reset(here=False)
    _watch(scene.robot, None)
    assert not scene.is_stopped()
    board.freeze()
    _watch(scene.robot, _watch(scene.robot, None))
    assert scene.is_stopped()


def test_watchers_get_every_period_that_passes_between_two_activities() -> None:
    """While a move is planned or a file is opened, nobody asks for samples; the bridge keeps 64 of them."""
    controller = WatchedController(Link(cast(Any, InProcess(Bridge, sample=True))))
    ticks: list[int] = []
    lost: list[tuple[int, int]] = []
    controller.listener = lambda snapshot: ticks.append(snapshot.tick)
    controller.lost = lambda count, tick: lost.append((count, tick))

    def pass_periods(count: int) -> None:
        controller.clock.sleep_until(controller.clock.now() + count * controller.period_s)
        controller.next_snapshot()

    for _ in range(3):
        pass_periods(5)
    assert ticks == list(range(ticks[0], ticks[0] + len(ticks)))
    assert (controller.counters.late, controller.counters.missing_samples, lost) == (0, 0, [])
    until = ticks[-1]
    pass_periods(100)
    ((count, tick),) = lost
    assert ticks[ticks.index(until) + 1 :] == list(range(tick, ticks[-1] + 1))
    assert tick - until - 1 == count > 0
