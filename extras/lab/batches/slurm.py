"""Workers that Slurm starts, by dask-jobqueue: this process has the scheduler, and every Slurm job is a worker."""

from __future__ import annotations

import shutil
import sys

from dask_jobqueue.slurm import SLURMCluster

from daq.contracts.errors import ReachError, SpecError
from extras.lab.batches.dask import DaskWorkers, connected
from extras.lab.batches.executors import Address

MEMORY, WALLTIME = "4GB", "08:00:00"
"""What each worker may use where the URL does not say it."""
PATIENCE = 24 * 3600.0
"""Time (s) that jobs may wait in Slurm's queue before the first of them begins."""


def slurm_workers(address: Address) -> DaskWorkers:
    """Asks Slurm for workers of one core each, and waits for the first. Raises SpecError, ReachError."""
    if shutil.which("sbatch") is None:
        raise ReachError(f"executor {address.url}: there is no sbatch here; start this on a computer of the cluster")
    try:
        cluster = SLURMCluster(
            queue=address.place or None,
            account=address.options.get("account"),
            cores=1,
            processes=1,
            memory=address.options.get("memory", MEMORY),
            walltime=address.options.get("walltime", WALLTIME),
            interface=address.options.get("interface"),
            python=sys.executable,
            scheduler_options={"dashboard_address": None},
        )
    except (OSError, ValueError) as error:
        raise SpecError(f"executor {address.url}: {error}") from error
    try:
        cluster.scale(jobs=address.workers or 1)
        cluster.sync(cluster._correct_state)  # else an error of sbatch is only logged, and nothing ever comes
    except (OSError, RuntimeError) as error:
        cluster.close()
        raise ReachError(f"executor {address.url}: sbatch: {str(error).partition(chr(10))[0]}") from error
    return connected(address.url, cluster.scheduler_address, cluster, PATIENCE)
