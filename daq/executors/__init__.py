"""Where jobs are computed: processes of this computer, a Dask cluster, or Slurm, chosen by a URL."""

from daq.executors.each import done_in_any_order
from daq.executors.opening import open_workers
from daq.executors.workers import Workers

__all__ = ["Workers", "done_in_any_order", "open_workers"]
