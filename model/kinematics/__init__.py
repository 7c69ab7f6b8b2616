"""Geometry of a serial chain."""
