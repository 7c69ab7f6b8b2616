"""The hash of a token, which is all that is stored of it."""

from __future__ import annotations

import hashlib


def digest_of(token: str) -> str:
    """The SHA-256 of a token. It needs no salt: a token has 256 random bits, so no dictionary helps."""
    return hashlib.sha256(token.encode()).hexdigest()
