"""Whether a record is what it says: checked before anything is computed from it. `check.py` is the entrance."""
