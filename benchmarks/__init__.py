"""Measurements: figures with their targets, each by one command. Timings depend on the machine, so none is a test."""
