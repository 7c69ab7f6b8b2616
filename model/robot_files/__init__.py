"""Robots in the formats of others: URDF to machine files, models to URDF and MJCF."""
