"""The hash of a token. Only the hash is stored."""

from __future__ import annotations

import hashlib


def digest_of(token: str) -> str:
    """Returns the SHA-256 of a token. It needs no salt, since a token has 256 random bits and cannot be guessed."""
    return hashlib.sha256(token.encode()).hexdigest()
