"""Between the board's word that it has stopped and its owner's report of that."""

from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any, NoReturn

import pytest

from daq.contracts.machine import load_machine
from daq.contracts.service.robot import ArmState, StopResult
from daq.owner.messages import Answer, ArmReport
from server.problems import ProblemError
from server.robot.robot import Robot, RobotPlace
from server.robot.stop import StopService
from server.robot.teaching import TeachingService
from tests.server.clocks import HandClock

JOG = {2: 0.1}


class Busy(Robot):
    """What it is asked goes on."""

    def ask(self, kind: Any, **fields: object) -> Future[Answer]:
        """An order that has no answer yet."""
        del kind, fields
        return Future()


@pytest.fixture
def robot() -> Robot:
    """Connected, idle."""
    robot = Busy(RobotPlace("ma2000", "mock://", load_machine("ma2000"), Path()), HandClock())
    robot._on_report(_report("idle"))
    return robot


@pytest.fixture
def stop_service(robot: Robot) -> Iterator[StopService]:
    """Whose stops are confirmed."""
    confirmed = StopResult(delivered=True, confirmed=True, tick=7, seconds=0.0, text="stopped")
    stop_service = StopService(robot, lambda _reach: confirmed)
    yield stop_service
    stop_service.close()


def _report(arm: ArmState) -> ArmReport:
    return ArmReport(arm=arm, cause="", activity="none", limp=(), link="connected", counters={})


@pytest.mark.parametrize("jogging", [True, False])
def test_nothing_is_jogged_after_a_confirmed_stop(robot: Robot, stop_service: StopService, jogging: bool) -> None:
    teaching = TeachingService(robot, lambda _line: None)
    if jogging:
        teaching.jog(JOG, robot.clock.monotonic())
    assert stop_service.stop_now().confirmed
    with pytest.raises(ProblemError) as refused:
        teaching.jog(JOG, robot.clock.monotonic())
    assert (refused.value.status, refused.value.kind) == (409, "arm-stopped")
    robot._on_report(_report("stopped"))
    with pytest.raises(ProblemError):
        teaching.jog(JOG, robot.clock.monotonic())
    robot._on_report(_report("idle"))  # after a reset
    teaching.jog(JOG, robot.clock.monotonic())
    assert teaching.status().activity == "jog"


def test_a_stop_that_finds_no_file_for_its_socket_says_that_it_was_not_delivered(
    robot: Robot, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_socket(*_: object) -> NoReturn:
        raise OSError(24, "Too many open files")

    monkeypatch.setattr("server.stopping.arm.request_stop", no_socket)
    stop_service = StopService(robot)
    told = stop_service.stop_now()
    stop_service.close()
    assert (told.delivered, told.confirmed) == (False, False)
    assert told.text == f"stop NOT DELIVERED: {told.detail}"
    assert told.detail == f"{told.note}. Use the emergency stop."
    assert told.text.endswith("Too many open files. Use the emergency stop.")


def test_a_fault_keeps_its_cause_when_it_is_stopped_too(robot: Robot, stop_service: StopService) -> None:
    fault = _report("fault").model_copy(update={"cause": "joint 2 moved"})
    robot._on_report(fault)
    assert stop_service.stop_now().confirmed
    assert robot.arm == fault
