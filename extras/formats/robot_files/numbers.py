"""Formats numbers for XML."""

from __future__ import annotations


def text_of(*values: float) -> str:
    """Returns numbers with all their digits, separated by spaces, without −0."""
    return " ".join(repr(float(value) + 0.0) for value in values)
