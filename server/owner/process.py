"""The owner of a robot from its first line of input to its last line of output."""

from __future__ import annotations

import sys
from contextlib import ExitStack

from daq.acquisition.freezer import Freezer
from daq.acquisition.guardian import Guardian
from daq.acquisition.speaker import Speaker
from daq.acquisition.stop_socket import stop_listener
from daq.contracts.errors import DaqError
from daq.runner import ArmControl
from daq.transport import PortBusyError
from firmware_protocol.errors import ProtocolError
from firmware_protocol.memory_map import default_memory_map, parse_memory_map
from server import logs
from server.owner.inbox import Inbox
from server.owner.messages import CannotOpen, Open, Opened
from server.owner.owned_robot import OwnedRobot
from server.owner.owner import serve
from server.owner.watched_controller import WatchedController
from server.steady import keep_steady

EXIT_WRONG_INPUT = 2
EXIT_INTERRUPTED = 130


def main() -> int:
    """Opens the robot of the first order, and serves until the service closes its end. Returns the exit code."""
    logs.begin()
    with Speaker(sys.stdout.fileno()) as speaker:
        inbox = Inbox(sys.stdin.fileno())
        try:
            own(inbox.first(), inbox, speaker)
        except DaqError as error:
            busy = isinstance(error, PortBusyError)
            speaker.ended(CannotOpen(problem=str(error), exit_code=error.exit_code, busy=busy))
            return error.exit_code
        except ProtocolError as error:
            speaker.ended(CannotOpen(problem=str(error), exit_code=EXIT_WRONG_INPUT))
            return EXIT_WRONG_INPUT
        except KeyboardInterrupt:
            return EXIT_INTERRUPTED
    return 0


def own(opening: Open, inbox: Inbox, speaker: Speaker) -> None:
    """Holds the port until the service wants it back. Raises DaqError, ProtocolError when it cannot be had."""
    memory_map = default_memory_map() if opening.memory_map is None else parse_memory_map(opening.memory_map)
    with (
        ExitStack() as closed_last,
        Freezer(opening.robot, opening.url) as freezer,
        stop_listener(opening.robot) as listener,
        Guardian(listener, inbox.guardian_end, freezer.freeze) as guardian,
    ):
        controller = closed_last.enter_context(WatchedController.connect(opening.url, memory_map))
        control = freezer.control = ArmControl(controller)
        robot = OwnedRobot(
            opening.robot,
            opening.machine,
            opening.limits,
            opening.folder,
            controller,
            control,
            guardian,
            inbox,
            speaker,
        )
        if (cause := robot.ended()) is not None:
            control.stop(cause)
        robot.read_gains()
        identity = controller.identity
        keep_steady()
        speaker.ended(
            Opened(
                simulated=identity.simulated,
                protocol=identity.version,
                period=identity.period_s,
                boots=identity.boots,
            )
        )
        with inbox.reading():
            serve(robot)
