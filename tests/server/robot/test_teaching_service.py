"""Teaching in the service, without a robot: when a command was said, what is left of a lead, no motion after a stop."""

import threading
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import closing
from pathlib import Path
from typing import Any, NoReturn

import pytest

from daq.contracts.machine import load_machine
from daq.contracts.service.robot import ArmState, StopResult
from daq.owner.messages import Answer, ArmReport, Finish, JogBegin, JogDrive, RunProgram
from daq.teaching.jog import DEAD_MAN
from daq.teaching.lead import PATIENCE
from daq.teaching.program import Program, Relative
from server.problems import ProblemError, conflict
from server.robot.robot import Robot, RobotPlace
from server.robot.stop import StopService
from server.robot.teaching import LEAD_ENDS_WITHIN, TeachingService, Word
from tests.server.clocks import HandClock

JOG = {2: 0.1}
PATH = {"joints": [1], "times": [0.0, 0.02], "positions": [[0.0], [0.1]]}
STEP = Program(name="step", machine="ma2000", instructions=(Relative(angles={1: 0.1}),))


class Asked(Robot):
    """A robot that keeps what its owner is told and asked for, and lets the test answer."""

    def __init__(self) -> None:
        super().__init__(RobotPlace("ma2000", "mock://", load_machine("ma2000"), Path()), HandClock())
        self.orders: list[Any] = []
        self.answers: list[Future[Answer]] = []
        self.finished = threading.Event()

    def ask(self, kind: Any, **fields: object) -> Future[Answer]:
        """An order with an answer."""
        self.orders.append(kind(number=len(self.orders), **fields))
        self.answers.append(Future())
        return self.answers[-1]

    def send(self, order: Any) -> None:
        """An order without."""
        self.orders.append(order)
        if isinstance(order, Finish):
            self.finished.set()


@pytest.fixture
def robot() -> Asked:
    """Connected, idle."""
    return Asked()


@pytest.fixture
def teaching(robot: Asked) -> TeachingService:
    return TeachingService(robot, lambda _line: None)


def test_a_command_goes_on_with_the_moment_at_which_it_arrived(robot: Asked, teaching: TeachingService) -> None:
    said = robot.clock.monotonic()
    robot.clock.turn(DEAD_MAN / 2)  # type: ignore[attr-defined]
    teaching.jog(JOG, said)
    assert robot.orders == [JogBegin(number=0, asked=said), JogDrive(velocities=JOG, said=said)]


def test_a_command_that_was_held_up_begins_nothing(robot: Asked, teaching: TeachingService) -> None:
    teaching.jog(JOG, robot.clock.monotonic() - DEAD_MAN - 0.1)
    assert (robot.orders, teaching.status().activity) == ([], "none")


def test_a_step_is_asked_for_as_one_with_the_moment_at_which_it_was_said(
    robot: Asked, teaching: TeachingService
) -> None:
    said = robot.clock.monotonic()
    robot.clock.turn(4.0)  # type: ignore[attr-defined]
    teaching.perform(Word(said), STEP, "step")
    assert robot.orders == [RunProgram(number=0, asked=said, program=STEP.model_dump(mode="json"), activity="step")]


def test_nothing_begins_once_the_control_has_lapsed_while_a_jog_came_to_its_end(
    robot: Asked, teaching: TeachingService
) -> None:
    lapsed: list[str] = []

    def require() -> None:
        assert robot.finished.is_set()
        if lapsed:
            raise conflict("control-lost", "you lost control of the robot", "take control again")

    refused: list[ProblemError] = []

    def perform() -> None:
        try:
            teaching.perform(Word(robot.clock.monotonic(), require), STEP)
        except ProblemError as problem:
            refused.append(problem)

    teaching.jog(JOG, robot.clock.monotonic())
    waiting = threading.Thread(target=perform)
    waiting.start()
    assert robot.finished.wait(60)
    lapsed.append("now")
    robot.answers[0].set_result(Answer(number=0))
    waiting.join()
    assert [problem.kind for problem in refused] == ["control-lost"]
    assert not any(isinstance(order, RunProgram) for order in robot.orders)


def test_a_lead_without_a_path_does_not_have_that_of_the_one_before(robot: Asked, teaching: TeachingService) -> None:
    teaching.lead(Word(0.0), (1,))
    robot.answers[0].set_result(Answer(number=0, data={"path": PATH}))
    assert teaching.status().path is not None
    teaching.lead(Word(0.0), (1,))
    assert teaching.status().path is None
    robot.answers[1].set_result(Answer(number=1, problem="lead: 1 samples are no path", exit_code=4))
    assert teaching.status().path is None


def test_the_end_of_a_lead_is_waited_for_as_long_as_the_arm_may_take_to_come_to_rest(robot: Asked) -> None:
    assert LEAD_ENDS_WITHIN > PATIENCE
    teaching = TeachingService(robot, lambda _line: None, ends_within=0.0)
    teaching.lead(Word(0.0), (1,))
    ending = threading.Thread(target=teaching.finish)
    ending.start()
    assert robot.finished.wait(60)
    robot.answers[0].set_result(Answer(number=0, data={"path": PATH}))
    ending.join()
    assert teaching.status().path is not None


def test_what_does_not_end_says_what_to_do(robot: Asked) -> None:
    """A stop holds nothing of an arm that is led."""
    teaching = TeachingService(robot, lambda _line: None, ends_within=0.0, lead_ends_within=0.0)
    teaching.lead(Word(0.0), (1,))
    with pytest.raises(ProblemError, match="lead did not end within") as refused:
        teaching.finish()
    assert "HOLD THE ARM" in refused.value.advice
    other = TeachingService(Asked(), lambda _line: None, ends_within=0.0)
    other.jog(JOG, robot.clock.monotonic())
    with pytest.raises(ProblemError, match="jog did not end within") as refused:
        other.finish()
    assert refused.value.advice == "stop the robot"


# ---- between the board's word that it has stopped and its owner's report of that


@pytest.fixture
def idle() -> Asked:
    """Connected, idle; what it is asked goes on."""
    robot = Asked()
    robot._on_report(_report("idle"))
    return robot


@pytest.fixture
def stop_service(idle: Asked) -> Iterator[StopService]:
    """Whose stops are confirmed."""
    confirmed = StopResult(delivered=True, confirmed=True, tick=7, seconds=0.0, text="stopped")
    stop_service = StopService(idle, lambda _reach: confirmed)
    yield stop_service
    stop_service.close()


def _report(arm: ArmState) -> ArmReport:
    return ArmReport(arm=arm, cause="", activity="none", limp=(), link="connected", counters={})


@pytest.mark.parametrize("jogging", [True, False])
def test_nothing_is_jogged_after_a_confirmed_stop(idle: Asked, stop_service: StopService, jogging: bool) -> None:
    teaching = TeachingService(idle, lambda _line: None)
    if jogging:
        teaching.jog(JOG, idle.clock.monotonic())
    assert stop_service.stop_now().confirmed
    with pytest.raises(ProblemError) as refused:
        teaching.jog(JOG, idle.clock.monotonic())
    assert (refused.value.status, refused.value.kind) == (409, "arm-stopped")
    idle._on_report(_report("stopped"))
    with pytest.raises(ProblemError):
        teaching.jog(JOG, idle.clock.monotonic())
    idle._on_report(_report("idle"))  # after a reset
    teaching.jog(JOG, idle.clock.monotonic())
    assert teaching.status().activity == "jog"


def test_a_stop_that_finds_no_file_for_its_socket_says_that_it_was_not_delivered(
    idle: Asked, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_socket(*_: object) -> NoReturn:
        raise OSError(24, "Too many open files")

    monkeypatch.setattr("server.stopping.arm.request_stop", no_socket)
    with closing(StopService(idle)) as stop_service:
        told = stop_service.stop_now()
    assert (told.delivered, told.confirmed) == (False, False)
    assert told.text == f"stop NOT DELIVERED: {told.detail}"
    assert told.detail == f"{told.note}. Use the emergency stop."
    assert told.text.endswith("Too many open files. Use the emergency stop.")


def test_a_fault_keeps_its_cause_when_it_is_stopped_too(idle: Asked, stop_service: StopService) -> None:
    fault = _report("fault").model_copy(update={"cause": "joint 2 moved"})
    idle._on_report(fault)
    assert stop_service.stop_now().confirmed
    assert idle.arm == fault
