"""Jobs through a scheduler and a worker of Dask in this process; in a test their threads would outlive it."""

import json

from distributed import LocalCluster

from daq.contracts.errors import ReachError
from daq.executors import done_in_any_order
from daq.executors.workers import ending
from extras.lab.batches import dask
from tests.daq.executors.by_hand import square


def fails(number: int) -> int:
    """A job with an error of its own."""
    raise ValueError(f"{number} is none")


def main() -> None:
    with (
        LocalCluster(n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None) as cluster,
        ending(dask.connected("dask://", cluster.scheduler_address)) as workers,
    ):
        squares = sorted(future.result() for _, future in done_in_any_order(workers, square, range(6)))
        ((_task, failed),) = done_in_any_order(workers, fails, [3])
        found = {"count": workers.count(), "squares": squares, "failed": repr(failed.exception())}
    dask.PATIENCE = 0.2
    try:
        dask.connected("dask://127.0.0.1:9", "tcp://127.0.0.1:9")
    except ReachError as error:
        found["refused"] = str(error)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
