"""The service's side of a robot's owner when the owner, or a listener, or the computer does what it should not."""

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from queue import SimpleQueue
from typing import NoReturn

import pytest

from daq.contracts.errors import DaqError, ReachError
from daq.contracts.machine import load_machine
from daq.owner.client import OwnerGoneError, OwnerProcess
from daq.owner.messages import Open, ReadGains, Report, TeachingText
from daq.owner.start import start_owner
from daq.transport import ReconnectDelay
from server.robot.keeper import Keeper
from server.robot.robot import Robot, RobotPlace
from tests.daq.servo_bench import pan_tilt
from tests.server.clocks import HandClock

HALF = '{"kind":"answer","num'
LINES = '{"kind":"told","text":"first"}\n{"kind":"told","text":"second"}\n'
MACHINE = load_machine("ma2000")
OPEN = Open(url="mock://", machine=MACHINE, limits=MACHINE.limits, folder=Path(), robot="ma2000")
Start = Callable[..., OwnerProcess]


def killed_after(output: str) -> Start:
    """Starts an owner that is a program which writes something, reads its first order, and kills itself."""
    program = ("sh", "-c", f"printf '%s' '{output}'; read -r order; kill -9 $$")
    return partial(OwnerProcess, process=start_owner(program))


@pytest.mark.parametrize("output", [HALF, f"{HALF}\n", f"no JSON\n{HALF}", ""])
def test_an_owner_killed_in_the_middle_of_a_report_is_gone(output: str) -> None:
    ended: SimpleQueue[str] = SimpleQueue()
    owner = killed_after(output)(OPEN, lambda _report: None, ended.put)
    answer = owner.ask(ReadGains, asked=0.0)
    assert ended.get(timeout=60) == "signal 9"
    for asked in (answer, owner.ask(ReadGains, asked=0.0)):
        with pytest.raises(OwnerGoneError):
            asked.result(0)
    assert owner.close()


def test_a_listener_at_fault_costs_nobody_else_a_report() -> None:
    robot = Robot(RobotPlace("ma2000", "mock://", MACHINE, Path()), HandClock(), killed_after(LINES))
    heard: SimpleQueue[Report] = SimpleQueue()
    ends: SimpleQueue[str] = SimpleQueue()

    def at_fault(_news: object) -> NoReturn:
        raise RuntimeError("a fault")

    robot.listeners += [at_fault, heard.put]
    robot.disconnected += [at_fault, ends.put]
    connecting = threading.Thread(target=_refused, args=(robot,))
    connecting.start()
    assert [heard.get(timeout=60) for _ in range(2)] == [TeachingText(text="first"), TeachingText(text="second")]
    assert ends.get(timeout=60) == "signal 9"
    connecting.join()
    assert robot.connection == "disconnected"


def _refused(robot: Robot) -> None:
    with pytest.raises(ReachError, match="signal 9"):
        robot.connect()


def test_a_process_that_cannot_be_started_is_a_robot_that_is_not_reached() -> None:
    def no_process(*_: object) -> NoReturn:
        raise OSError(12, "Cannot allocate memory")

    robot = Robot(RobotPlace("ma2000", "mock://", MACHINE, Path()), HandClock(), no_process)
    with pytest.raises(ReachError, match="Cannot allocate memory"):
        robot.connect()
    assert (robot.connection, "Cannot allocate memory" in robot.problem) == ("disconnected", True)


@pytest.mark.parametrize("error", [OSError(24, "Too many open files"), ValueError("a fault"), ReachError("no answer")])
def test_whatever_keeps_it_from_connecting_is_tried_again(error: Exception) -> None:
    tried, third = [0], threading.Event()

    class Unreachable(Robot):
        def connect(self, **_: object) -> None:
            tried[0] += 1
            if tried[0] == 3:
                third.set()
            raise error

    robot = Unreachable(RobotPlace("ma2000", "mock://", MACHINE, Path()), HandClock())
    keeper = Keeper(robot, ReconnectDelay(1e-6, 1e-6))
    keeper.start(connect=True)
    assert third.wait(60)
    keeper.close(60)


def test_a_robot_with_another_machines_file_is_not_connected(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its live angles would be wrong."""
    monkeypatch.setenv("DAQ_RUNTIME_FOLDER", str(tmp_path))
    robot = Robot(RobotPlace("ma2000", "mock://?lock_step=1", pan_tilt(), tmp_path), HandClock())
    with pytest.raises(DaqError, match="has 6 joints, the machine file pan_tilt describes 2"):
        robot.connect()
    assert robot.identity is None
    assert robot.disconnect(60.0)
