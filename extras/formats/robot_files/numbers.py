"""Numbers in XML."""

from __future__ import annotations


def text_of(*values: float) -> str:
    """Numbers with all their digits, separated by spaces; there is no −0."""
    return " ".join(repr(float(value) + 0.0) for value in values)
