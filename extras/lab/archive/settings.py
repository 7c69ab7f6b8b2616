"""The configuration of the archive: where traces are stored, and which copies stay on this computer."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated
from urllib.parse import urlsplit

from pydantic import Field, field_validator

from daq.config.section import Section

BUCKET = r"^[a-z0-9][a-z0-9.-]{1,61}[a-z0-9]$"
"""Names of buckets, as S3 allows them."""


class ArchiveSettings(Section):
    """Section `[archive]`. Without a bucket there is no archive."""

    SHOWN = frozenset(["bucket", "region", "prefix", "credentials", "keep_days", "keep_size", "keep_used", "timeout"])

    bucket: Annotated[str, Field(pattern=BUCKET)] | None = None
    """Name of the bucket, which must exist."""
    endpoint: Annotated[str, Field(max_length=500)] | None = None
    """URL of an S3 server; None for Amazon's of the `region`. Only the configuration names it: no request can."""
    region: Annotated[str, Field(pattern=r"^[A-Za-z0-9-]{1,64}$")] = "us-east-1"
    """Region of the bucket. Most other servers than Amazon's ignore it."""
    prefix: Annotated[
        str, Field(pattern=r"^([A-Za-z0-9][A-Za-z0-9._-]{0,63}(/[A-Za-z0-9][A-Za-z0-9._-]{0,63})*)?$")
    ] = ""
    """Beginning of the objects' names, for several services with one bucket."""
    credentials: Path | None = None
    """File with `access_key` and `secret_key`; None for the environment (`AWS_ACCESS_KEY_ID` and so on)."""
    keep_days: Annotated[float, Field(ge=0, le=100_000)] | None = None
    """Age (days) beyond which the local copy of an archived trace is dropped; None keeps it."""
    keep_size: Annotated[int, Field(ge=0, le=1 << 40)] | None = None
    """Total size (MB) of local traces beyond which the oldest archived ones are dropped; None keeps them."""
    keep_used: bool = True
    """Whether local copies of traces that a model or a job refers to stay in any case."""
    timeout: Annotated[float, Field(ge=0.1, le=600)] = 30.0
    """Time (s) that one request to the store may take. A trace is sent and fetched in pieces of 8 MB."""

    @field_validator("bucket", mode="before")
    @classmethod
    def _is_name(cls, bucket: object) -> object:
        """Raises ValueError for an invalid bucket name, in words: the pattern alone would not be clear."""
        if isinstance(bucket, str) and not re.fullmatch(BUCKET, bucket):
            raise ValueError("is not the name of a bucket; write 3 to 63 lower-case letters, digits, dots and hyphens")
        return bucket

    @field_validator("endpoint")
    @classmethod
    def _is_address(cls, endpoint: str | None) -> str | None:
        """Raises ValueError for an invalid URL, and for one with a password: URLs are shown."""
        if endpoint is None:
            return None
        try:
            parts = urlsplit(endpoint)
            _ = parts.port
        except ValueError:
            raise ValueError("is not a URL; write https://host:port") from None
        if parts.username is not None or parts.password is not None:
            raise ValueError("has a password in it; put it into the file `credentials`, or the environment")
        if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment:
            raise ValueError("is not a URL; write https://host:port")
        return endpoint.rstrip("/")

    @field_validator("credentials")
    @classmethod
    def _expanded(cls, file: Path | None) -> Path | None:
        return None if file is None else file.expanduser()

    @property
    def place(self) -> str:
        """Returns the location of the archive, for messages."""
        return f"{self.bucket} at {self.endpoint or f'Amazon S3, {self.region}'}"
