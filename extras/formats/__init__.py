"""Robots, records and lines in the formats of others."""
