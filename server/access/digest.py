"""What is kept of a token."""

from __future__ import annotations

import hashlib


def digest_of(token: str) -> str:
    """Its SHA-256: it has 256 random bits, so there is nothing to guess, and no dictionary to try."""
    return hashlib.sha256(token.encode()).hexdigest()
