"""The driver when its session is over, and when a stop comes in the very moment of a release."""

from collections.abc import Callable

import pytest

from daq.driver import Controller, ControllerRestartedError
from daq.link import Link, RequestRefusedError
from firmware_protocol.commands import Hello, Refusal, Release, Stop
from firmware_protocol.framing import Frame
from firmware_protocol.message import Request
from firmware_protocol.session import to_frame
from mock_controller.bridge.bridge import Bridge
from tests.mock.in_process import InProcess


class Overheard(Bridge):
    """Hears other frames just before a request of one kind."""

    before: type[Request] | None = None
    hears: Request = Stop()

    def receive(self, frame: Frame) -> list[Frame]:
        if self.before is not None and frame.opcode == self.before.OPCODE:
            self.before = None
            super().receive(to_frame(0, self.hears))
        return super().receive(frame)


@pytest.fixture
def endpoint() -> InProcess:
    return InProcess(Overheard, sample=True)


@pytest.fixture
def controller(endpoint: InProcess) -> Controller:
    return Controller(Link(endpoint))


def greeted_by_another(endpoint: InProcess) -> None:
    endpoint.bridge.receive(to_frame(0, Hello(2, 0xABCDEF01)))


COMMANDS: tuple[Callable[[Controller], object], ...] = (
    lambda controller: controller.set_points({1: 510}),
    lambda controller: controller.next_snapshot(set_points={1: 510}),
    lambda controller: controller.set_gains(1, 3, 0, 0),
    lambda controller: controller.set_gripper(closed=True),
    lambda controller: controller.write_outputs(1, 1),
)


@pytest.mark.parametrize("command", COMMANDS)
def test_a_host_that_another_has_replaced_commands_no_more(
    controller: Controller, endpoint: InProcess, command: Callable[[Controller], object]
) -> None:
    greeted_by_another(endpoint)
    with pytest.raises(RequestRefusedError, match="another host has taken control; connect again") as caught:
        command(controller)
    assert caught.value.reason == Refusal.BAD_SESSION
    assert controller.next_snapshot().positions, "reading goes on"
    assert controller.stop().acknowledged, "and so does stopping"
    assert endpoint.board.frozen


def test_a_reset_takes_the_control_back_and_passes_over_no_restart(controller: Controller, endpoint: InProcess) -> None:
    greeted_by_another(endpoint)
    assert controller.stop().acknowledged
    controller.release(controller.status().stop)
    assert not endpoint.board.frozen
    controller.set_points({1: 510})
    endpoint.board.brown_out()
    endpoint.bridge.run_until(endpoint.board.time_us + 200_000)
    with pytest.raises(ControllerRestartedError):
        controller.release(controller.status().stop)
    controller.hello()
    controller.release(controller.status().stop)


def test_a_release_ends_the_stop_that_it_names_and_no_later_one(controller: Controller, endpoint: InProcess) -> None:
    assert controller.stop().acknowledged
    seen = controller.status().stop
    endpoint.bridge.receive(to_frame(0, Stop()))
    greeted_by_another(endpoint)
    with pytest.raises(RequestRefusedError, match="a newer stop is in force"):
        controller.release(seen)
    assert endpoint.board.frozen
    controller.release(controller.status().stop)
    assert not endpoint.board.frozen
    assert controller.stop().acknowledged
    endpoint.bridge.before = Release
    with pytest.raises(RequestRefusedError, match="a newer stop is in force"):
        controller.release(controller.status().stop)
    assert endpoint.board.frozen
    controller.release(controller.status().stop)
    assert not endpoint.board.frozen


def test_set_points_of_before_a_restart_of_the_board_move_nothing(controller: Controller, endpoint: InProcess) -> None:
    controller.set_points({1: 600})
    endpoint.board.brown_out()
    endpoint.bridge.run_until(endpoint.board.time_us + 200_000)
    at_power_up = endpoint.board.memory.values("set_point")
    with pytest.raises(ControllerRestartedError):
        controller.set_points({1: 601})
    assert endpoint.board.memory.values("set_point") == at_power_up
