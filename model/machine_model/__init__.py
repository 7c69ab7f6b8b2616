"""A machine file as a model: named parameters, the effects in it, the vector that the simulation reads."""
