"""Text from outside, for a terminal."""

from __future__ import annotations


def printable(text: str) -> str:
    """Replaces control characters in text from outside, which could affect the terminal."""
    return "".join(sign if sign.isprintable() or sign == "\n" else "\N{REPLACEMENT CHARACTER}" for sign in text)
