"""Turns a specified motion into set points for every control period. Pure: nothing here moves an arm."""
