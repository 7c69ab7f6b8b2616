"""Transactions with a controller: numbered, repeated until answered, matched with replies, and counted."""

from daq.link.counters import LinkCounters, RoundTrips
from daq.link.errors import LinkError, LinkLostError, LinkTimeoutError, RequestRefusedError, StopCameFirstError
from daq.link.link import Link, LinkState, expect

__all__ = [
    "Link",
    "LinkCounters",
    "LinkError",
    "LinkLostError",
    "LinkState",
    "LinkTimeoutError",
    "RequestRefusedError",
    "RoundTrips",
    "StopCameFirstError",
    "expect",
]
