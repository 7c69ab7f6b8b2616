"""Geometry of a serial chain: its description, D-H transforms, positions and Jacobians."""
