"""Measurements with targets, each run by one command. Timings depend on the machine, so none is a test."""
