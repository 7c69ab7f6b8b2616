"""Converts a machine file to a model: named parameters, effects, and the vector that the simulation reads."""
