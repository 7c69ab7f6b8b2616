"""Opens the executor of a URL."""

from __future__ import annotations

from collections.abc import Callable

from daq.contracts.extras import require_extra
from daq.executors.address import Address, executors, parse_address
from daq.executors.local import LocalWorkers, cores
from daq.executors.workers import Workers
from daq.plugins import named


def open_workers(url: str, initializer: Callable[[], None] | None = None, patience: float | None = None) -> Workers:
    """Opens the executor of a URL (docs/batches.md).

    Args:
        initializer: what a process of this computer does first, in place of `begin_worker`; other workers are set up
            by whoever starts them.
        patience: time (s) within which a running scheduler must answer, and have a worker; None for the usual one.

    Raises SpecError for a URL of no executor; MissingExtraError; ReachError for a scheduler that does not answer;
    OtherVersionError.
    """
    address = parse_address(url)
    if address.kind == "local":
        return LocalWorkers(address.workers or cores(), initializer)
    require_installed(address)
    workers: Workers = named(executors()[address.kind].opened)(address, patience)
    return workers


def require_installed(address: Address) -> None:
    """Raises MissingExtraError where the executor's package is missing."""
    if address.kind != "local":
        extra, module = executors()[address.kind].needs
        require_extra(extra, f"executor {address.url}", module)
