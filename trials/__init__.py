"""Registered trials on independent test rigs, for developers: the rigs are in `tests/worlds`."""
