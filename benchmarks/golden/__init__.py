"""Answers recorded before a change that must not alter them, and the comparison with them."""
