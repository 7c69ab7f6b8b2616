"""Opens the executor of a URL."""

from __future__ import annotations

from collections.abc import Callable

from daq.contracts.extras import require_extra
from daq.executors.address import Address, parse_address
from daq.executors.local import LocalWorkers, cores
from daq.executors.workers import Workers

NEEDED = {"dask": "distributed", "dask+tls": "distributed", "slurm": "dask_jobqueue"}
"""The module without which an executor cannot be opened."""


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
    if address.kind == "slurm":
        from daq.executors.slurm import slurm_workers

        return slurm_workers(address)
    from daq.executors.dask import dask_workers

    return dask_workers(address) if patience is None else dask_workers(address, patience)


def require_installed(address: Address) -> None:
    """Raises MissingExtraError where the executor's package is missing."""
    module = NEEDED.get(address.kind)
    if module is not None:
        require_extra("cluster", f"executor {address.url}", module)
