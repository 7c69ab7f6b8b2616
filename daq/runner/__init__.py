"""Runs one experiment: prepares, checks, moves to the start, follows the plan, records, and ends in a known state."""
