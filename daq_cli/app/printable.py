"""Text from outside, for a terminal."""

from __future__ import annotations


def printable(text: str) -> str:
    """Text of a file that somebody else may have made, without control characters for the terminal."""
    return "".join(sign if sign.isprintable() or sign == "\n" else "\N{REPLACEMENT CHARACTER}" for sign in text)
