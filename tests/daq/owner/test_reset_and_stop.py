"""In the owner's process: a reset ends the stop that its asker knew of, and none that has come since."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import pytest

from daq.contracts.errors import SafetyError
from daq.contracts.machine import load_machine
from daq.link import Link
from daq.owner import stop_socket
from daq.owner.guardian import EndCause, Guardian
from daq.owner.messages import MoveGripper, Open, Reset
from daq.owner.owned_robot import OwnedRobot
from daq.owner.quick_orders import carry_out
from daq.owner.speaker import Speaker
from daq.owner.stop_socket import StopAnswer, request_stop, stop_listener
from daq.owner.watched_controller import WatchedController
from daq.runner.arm_control import ArmControl
from daq.safety import State
from firmware_protocol.commands import ReadStatus, Release, Request, Stop, to_frame
from firmware_protocol.framing import Frame
from mock_controller.bridge.bridge import Bridge
from tests.mock.in_process import InProcess


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
        """From whomever."""
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
def test_a_stop_while_the_reset_is_carried_out_holds(
    scene: Scene, here: bool, request_under_way: type[Request]
) -> None:
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
def test_a_reset_ends_no_stop_that_its_sender_had_not_seen_however_late_it_is_said_to_have_arrived(
    scene: Scene, here: bool
) -> None:
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
