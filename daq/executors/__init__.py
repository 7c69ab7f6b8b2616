"""Executors that compute jobs in processes of this computer."""

from daq.executors.local import LocalWorkers, Workers, cores, done_in_any_order

__all__ = ["LocalWorkers", "Workers", "cores", "done_in_any_order"]
