"""The name by which services that only read tell where the service is that owns the arms."""

from __future__ import annotations

import ipaddress
from collections.abc import Sequence

LONGEST = 63
"""Number of bytes that PostgreSQL keeps of the name of a connection."""


def owner_name(names: Sequence[str], bound: str, port: int, computer: str) -> str:
    """Returns where a service is, in words for people at other computers: LONGEST characters of ASCII at most.

    names:    those by which browsers reach it (`server.names`); the first counts
    bound:    the address at which it listens. It leads nowhere from another computer if it is loopback, or stands for
              every address of its computer, and is left out then
    port:     the port at which it listens
    computer: the name of its computer
    """
    place = f"port {port} of {_ascii(computer)}"
    known = names[0] if names else _address(bound, port)
    told = [place]
    if known and known.isascii():
        told = [f"{known} ({place})", known, place]
    # A name of which the end is cut leads nowhere: what is too long as a whole is told in part.
    return next((words for words in told if len(words) <= LONGEST), f"{place[: LONGEST - 3]}...")


def _address(bound: str, port: int) -> str:
    address = ipaddress.ip_address(bound)
    if address.is_loopback or address.is_unspecified:
        return ""
    return f"http://{f'[{bound}]' if address.version == 6 else bound}:{port}"


def _ascii(name: str) -> str:
    return name.encode("ascii", "replace").decode()
