"""Computations in worker processes, at low priority."""
