"""Imports and exports robots, records and tables in the formats of other programs."""
