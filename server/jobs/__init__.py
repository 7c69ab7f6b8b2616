"""Computations in worker processes, at low priority. The executor is the seam for a cluster."""
