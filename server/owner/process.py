"""The main program of the owner of a robot."""

from __future__ import annotations

import sys

from daq.acquisition.session import port_session
from daq.acquisition.speaker import Speaker
from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.runner.preparation import require_fitting
from daq.transport import PortBusyError
from firmware_protocol.commands import Capability
from firmware_protocol.errors import ProtocolError
from firmware_protocol.memory_map import default_memory_map, parse_memory_map
from server import logs
from server.owner.inbox import Inbox
from server.owner.messages import Answer, CannotOpen, Open, Opened
from server.owner.owned_robot import OwnedRobot
from server.owner.owner import serve
from server.owner.watched_controller import WatchedController
from server.steady import keep_steady


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
            speaker.ended(CannotOpen(problem=str(error), exit_code=exit_codes.WRONG_INPUT))
            return exit_codes.WRONG_INPUT
        except KeyboardInterrupt:
            return exit_codes.INTERRUPTED
    return 0


def own(opening: Open, inbox: Inbox, speaker: Speaker) -> None:
    """Owns the port until the service wants it back. Raises DaqError, ProtocolError if it cannot be opened."""
    memory_map = default_memory_map() if opening.memory_map is None else parse_memory_map(opening.memory_map)
    with port_session(
        WatchedController.connect, opening.robot, opening.url, memory_map, parent=inbox.guardian_end
    ) as session:
        controller, control = session.controller, session.take_control()
        robot = OwnedRobot(
            opening.robot,
            opening.machine,
            opening.limits,
            opening.folder,
            controller,
            control,
            session.guardian,
            inbox,
            speaker,
        )
        if (cause := robot.end_cause()) is not None:
            control.stop(cause)
        require_fitting(controller, opening.machine)
        robot.read_gains()
        identity = controller.identity
        keep_steady()
        speaker.ended(
            Opened(
                simulated=identity.simulated,
                protocol=identity.version,
                period=identity.period_s,
                boots=identity.boots,
                samples=identity.keeps_samples,
                compact=Capability.COMPACT in identity.capabilities,
            )
        )
        inbox.freeze = lambda order: speaker.say(Answer(number=order.number, data=session.guardian.stop().as_data()))
        with inbox.reading():
            serve(robot)
