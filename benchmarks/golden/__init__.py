"""Answers recorded before a change that is to leave them as they are, and the comparison with them."""
