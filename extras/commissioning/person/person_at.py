"""Chooses the person at the arm: at the terminal, or a mock's stand-in."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from daq_cli.app.context import Invocation
    from extras.commissioning.person.mock_hand import MockOperator
    from extras.commissioning.person.terminal_operator import TerminalOperator


@contextmanager
def person_at(call: Invocation, mock_control: str | None) -> Iterator[TerminalOperator | MockOperator]:
    """Yields the one who carries out the tasks. `mock_control`: the control port of a mock. Raises SpecError."""
    if mock_control is None:
        from extras.commissioning.person.terminal_operator import TerminalOperator

        yield TerminalOperator()
        return
    from daq.transport.url import parse_port_url
    from daq_cli.app.context import console
    from extras.commissioning.person.mock_hand import mock_operator

    port = parse_port_url(call.port)
    lock_step = bool(getattr(port, "lock_step", False))
    with mock_operator(mock_control, call.settings.machine(), console().print, lock_step=lock_step) as operator:
        yield operator
