"""Computations in worker processes, at low priority. Another executor could run them on a cluster."""
