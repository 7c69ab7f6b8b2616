"""Executors that compute jobs: processes of this computer, or those of a plug-in."""

from daq.executors.each import done_in_any_order
from daq.executors.local import LocalWorkers, cores
from daq.executors.workers import Workers

__all__ = ["LocalWorkers", "Workers", "cores", "done_in_any_order"]
