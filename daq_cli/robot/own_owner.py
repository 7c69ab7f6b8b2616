"""Starts an owner of this computer's port for one command."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from daq.contracts.consent import lacks_consent
from daq_cli.app.consent import ConsentPrompt
from daq_cli.app.context import Invocation
from daq_cli.app.stop_keys import StopKeys

if TYPE_CHECKING:
    from daq.contracts.machine import Machine
    from daq.owner.client import OwnerOnDemand
    from daq.owner.messages import Open


@contextmanager
def owned(
    call: Invocation,
    machine: Machine,
    consent: ConsentPrompt | None,
    folder: Path | None = None,
    *,
    moves: bool = False,
    live: bool = False,
) -> Iterator[OwnerOnDemand]:
    """Yields an owner of the command's port; with `consent`, only after the operator's consent for a real arm. If
    `moves` is set, Ctrl-C, Ctrl-Z and SIGTERM become a stop.

    No process holds the port while the operator is asked, so that `daq stop` can use it. Raises OrderFailedError if the
    robot cannot be reached, SpecError for an invalid port, SafetyError without consent.
    """
    from daq.config.robot_files import load_memory_map
    from daq.owner.messages import Open
    from daq.transport import parse_port_url

    parse_port_url(call.port)  # reject an invalid port before starting a process
    opening = Open(
        url=call.port,
        machine=machine,
        limits=machine.limits,
        folder=folder or Path(),
        robot=call.settings.robot.name,
        memory_map=call.memory_map_text,
        live=live,
    )
    with _opened(opening, moves=moves) as owner:
        identity = owner.identity
        if consent is None or not lacks_consent(identity, consent.given):
            yield owner
            return
    consent.for_gains_of(load_memory_map(call.settings.robot.memory_map)).require(call.port, identity)
    with _opened(opening, moves=moves) as owner:
        yield owner


@contextmanager
def _opened(opening: Open, *, moves: bool) -> Iterator[OwnerOnDemand]:
    from daq.owner.client import OwnerOnDemand

    with ExitStack() as entered:
        keys = entered.enter_context(StopKeys()) if moves else None
        owner = entered.enter_context(OwnerOnDemand(opening))
        if keys is not None:
            keys.stops(owner.halt)
        yield owner
