"""Executors that compute jobs in processes of this computer."""

from daq.executors.each import done_in_any_order
from daq.executors.local import LocalWorkers, cores
from daq.executors.workers import Workers

__all__ = ["LocalWorkers", "Workers", "cores", "done_in_any_order"]
