"""Main program of the owner process."""

from __future__ import annotations

import sys
from collections.abc import Callable

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.contracts.service.robot import RobotIdentity
from daq.driver.controller import Identity
from daq.owner.guardian import Guardian
from daq.owner.inbox import Inbox
from daq.owner.loop import serve
from daq.owner.messages import Answer, CannotOpen, Freeze, Open, Opened
from daq.owner.owned_robot import OwnedRobot
from daq.owner.session import port_session
from daq.owner.speaker import Speaker
from daq.owner.watched_controller import WatchedController
from daq.runner.preparation import require_matching_machine
from daq.transport import PortBusyError
from firmware_protocol.commands import Capability
from firmware_protocol.errors import ProtocolError
from firmware_protocol.memory_map import default_memory_map, parse_memory_map


def main(loaded: Callable[[], None] = lambda: None) -> int:
    """Opens the robot of the first order, and serves until the client closes its end. Returns the exit code.

    loaded: called once the robot is open, before the client is informed
    """
    with Speaker(sys.stdout.fileno()) as speaker:
        inbox = Inbox(sys.stdin.fileno())
        try:
            own(inbox.first(), inbox, speaker, loaded)
        except DaqError as error:
            busy = isinstance(error, PortBusyError)
            speaker.ended(CannotOpen(problem=str(error), exit_code=error.exit_code, busy=busy))
            return error.exit_code
        except ProtocolError as error:
            speaker.ended(CannotOpen(problem=str(error), exit_code=exit_codes.WRONG_INPUT))
            return exit_codes.WRONG_INPUT
        except KeyboardInterrupt:
            return exit_codes.INTERRUPTED
        except BaseException as error:
            line = f"program fault: {type(error).__name__}: {error}"
            speaker.ended(CannotOpen(problem=line, exit_code=exit_codes.PROGRAM_FAULT))
            raise
    return 0


def own(opening: Open, inbox: Inbox, speaker: Speaker, loaded: Callable[[], None]) -> None:
    """Owns the port until the client returns it. Raises DaqError or ProtocolError if the port cannot be opened."""
    memory_map = default_memory_map() if opening.memory_map is None else parse_memory_map(opening.memory_map)

    def guarded(guardian: Guardian) -> None:
        def freeze(order: Freeze) -> None:
            speaker.say(Answer(number=order.number, data=guardian.stop().as_data()))

        inbox.freeze = freeze
        inbox.begin()

    with port_session(
        WatchedController.connect,
        opening.robot,
        opening.url,
        memory_map,
        parent=inbox.guardian_end,
        guarded=guarded,
    ) as session:
        controller, control = session.controller, session.take_control()
        robot = OwnedRobot(opening, controller, control, session.guardian, inbox, speaker)
        if (cause := robot.end_cause()) is not None:
            # The stop came before there was an arm to freeze: freeze it now.
            control.stop(cause)
        if opening.watched:
            require_matching_machine(controller, opening.machine)
            robot.read_gains()
        loaded()
        speaker.ended(Opened(identity=_identity(controller.identity)))
        serve(robot)


def _identity(identity: Identity) -> RobotIdentity:
    return RobotIdentity(
        simulated=identity.simulated,
        protocol=identity.version,
        period=identity.period_s,
        boots=identity.boots,
        samples=identity.keeps_samples,
        compact=Capability.COMPACT in identity.capabilities,
    )
