"""Checks a record for impossible values and wrong columns before anything is computed from it; `check.py` is the
entry."""
