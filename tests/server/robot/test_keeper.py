"""Giving the port back while a connection is being made."""

import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from daq.contracts.errors import ReachError
from daq.contracts.machine import load_machine
from daq.contracts.service.robot import RobotIdentity
from daq.owner.messages import ArmReport, Opened, Report
from server.robot.keeper import Keeper
from server.robot.robot import Robot, RobotPlace
from tests.server.clocks import HandClock
from tests.server.meanwhile import Meanwhile


class SlowOwner:
    """A process that takes until `go` to be started, and never greets."""

    made: list["SlowOwner"]
    begun: threading.Event
    go: threading.Event

    def __init__(self, _opening: object, _report: object, ended: Callable[[str], None]) -> None:
        self.begun.set()
        assert self.go.wait(60)
        self.ended = ended
        self.pid = 0
        self.closed = False
        self.made.append(self)

    def close(self, _patience: float) -> bool:
        self.closed = True
        self.ended("exit code 0")
        return True


@pytest.fixture
def owners() -> Any:
    """What stands for processes of owners."""

    class Owners(SlowOwner):
        made, begun, go = [], threading.Event(), threading.Event()

    return Owners


@pytest.fixture
def robot(owners: Any) -> Any:
    """Not connected; something may happen as it is asked to connect or disconnect."""
    return Meanwhile(Robot(RobotPlace("ma2000", "mock://", load_machine("ma2000"), Path()), HandClock(), owners))


def test_a_port_is_not_free_while_a_process_for_it_is_started(owners: Any, robot: Any) -> None:
    keeper, entered = Keeper(robot), threading.Event()
    robot.before("disconnect", entered.set)
    keeper.start(connect=False)
    connecting = threading.Thread(target=_refused, args=(keeper.connect,))
    connecting.start()
    assert owners.begun.wait(60)
    answers: list[bool] = []
    disconnecting = threading.Thread(target=lambda: answers.append(keeper.disconnect()))
    disconnecting.start()
    assert entered.wait(60)
    owners.go.set()
    disconnecting.join()
    assert answers == [True]
    assert [one.closed for one in owners.made] == [True]
    connecting.join()
    assert robot.connection == "disconnected"
    keeper.close(60)


@pytest.mark.parametrize("ending", ["disconnect", "close"])
def test_nothing_is_begun_that_is_not_wanted_any_more(owners: Any, robot: Any, ending: str) -> None:
    keeper = Keeper(robot)
    robot.before("connect", keeper.disconnect if ending == "disconnect" else partial(keeper.close, 60))
    owners.go.set()
    _refused(keeper.connect)
    assert owners.made == []


class GreetingOwner(SlowOwner):
    """Greets, and the first one then loses its link."""

    def __init__(self, opening: object, report: Callable[[Report], None], ended: Callable[[str], None]) -> None:
        super().__init__(opening, report, ended)
        report(Opened(identity=RobotIdentity(simulated=True, protocol=2, period=0.02, boots=len(self.made))))
        link: Any = "lost" if len(self.made) == 1 else "connected"
        report(ArmReport(arm="idle", cause="", activity="none", limp=(), link=link, counters={}))


def test_who_connects_after_a_lost_link_gets_a_new_process() -> None:
    class Owners(GreetingOwner):
        made, begun, go = [], threading.Event(), threading.Event()

    Owners.go.set()
    robot = Robot(RobotPlace("ma2000", "mock://", load_machine("ma2000"), Path()), HandClock(), Owners)
    keeper = Keeper(robot)
    keeper.connect()
    assert robot.connection == "lost"
    keeper.connect()
    assert (robot.connection, [one.closed for one in Owners.made]) == ("connected", [True, False])
    whys: list[str] = []
    robot.disconnected.append(whys.append)
    keeper.disconnect()
    assert (robot.problem, whys) == ("", ["disconnected on request"]), "who asks for an end has no problem"


def _refused(connect: Callable[[], None]) -> None:
    with pytest.raises(ReachError):
        connect()
