"""One look at the robot from the command line: the port is opened for the moment of a question or an answer."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from daq.contracts.errors import ReachError
from daq_cli.app.context import Invocation

if TYPE_CHECKING:
    from daq.driver import Controller


@contextmanager
def connected(call: Invocation) -> Iterator[Controller]:
    """The configured controller, greeted; closed afterwards. Nothing is sent that could move it.

    Raises ReachError when no robot is configured: a mock of its own would have nothing to tell.
    """
    from daq.config.robot_files import load_memory_map
    from daq.driver import Controller

    if call.port_option is None and call.settings.robot.port is None:
        raise ReachError("no robot is configured: give --port, or set robot.port in daq.toml (`daq config show`)")
    with Controller.connect(call.port, load_memory_map(call.settings.robot.memory_map)) as controller:
        yield controller
