"""Trials of the diagnosis on independent test rigs, for developers; not in the wheel."""
