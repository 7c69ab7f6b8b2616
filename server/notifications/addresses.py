"""Which addresses a webhook may reach: public ones, and those of hosts that the configuration lists.

A webhook makes the service send requests from inside the laboratory's network, so a wrong or hostile address could
reach what outsiders cannot (server-side request forgery; OWASP's cheat sheet of that name has the rules that are
applied here). A name is resolved once for an attempt, and the connection goes to the very address that was checked, so
that a name that changes its address in between (DNS rebinding) gains nothing.
"""

from __future__ import annotations

import socket
from collections.abc import Callable, Iterable
from ipaddress import IPv4Address, IPv6Address, IPv6Network, ip_address

from server.notifications.delivery import DeliveryError

Address = IPv4Address | IPv6Address
Resolver = Callable[[str, int], Iterable[str]]
MOST_ADDRESSES = 8
"""Number of addresses of a name that are looked at."""
NAT64 = IPv6Network("64:ff9b::/96")
"""Addresses that lead to the IPv4 address in their last four bytes (RFC 6052)."""
TRANSLATED = tuple(map(IPv6Network, ("::/96", "64:ff9b:1::/48", "2001::/32", "2002::/16", "fec0::/10")))
"""IPv4-compatible addresses, NAT64 with a local prefix (RFC 8215), Teredo, 6to4, site-local ones: all obsolete or
local, most of them a way to an IPv4 address that is not looked at."""
NOBODY = tuple(map(ip_address, ("169.254.169.254", "fd00:ec2::254", "100.100.100.200", "168.63.129.16")))
"""Addresses at which clouds tell a computer its own keys."""


class RefusedAddressError(DeliveryError):
    """A webhook's host has an address that it may not have."""


def resolve(host: str, port: int) -> Iterable[str]:
    """Returns the addresses of a host, as the computer's resolver has them. Raises OSError."""
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    return dict.fromkeys(str(place[4][0]) for place in found)


def addresses_of(host: str, port: int, *, listed: bool, resolver: Resolver = resolve) -> list[Address]:
    """Returns the addresses to connect to. Raises DeliveryError for a name that cannot be resolved, and
    RefusedAddressError if any of its addresses is not allowed.

    Args:
        listed: whether the configuration lists the host among those that may be private.
    """
    try:
        texts = list(resolver(host, port))[:MOST_ADDRESSES]
        found = [ip_address(text.partition("%")[0]) for text in texts]
    except (OSError, UnicodeError, ValueError) as error:
        why = getattr(error, "strerror", None) or "its name is not valid"
        raise DeliveryError(f"{host}: has no address: {why}") from error
    if not found:
        raise DeliveryError(f"{host}: has no address")
    for address in found:
        if why := why_refused(address, listed=listed):
            raise RefusedAddressError(f"{host}: {why}; notifications.private_hosts lists the hosts that may be private")
    return found


def why_refused(address: Address, *, listed: bool = False) -> str:
    """Returns why an address may not be reached; an empty text if it may.

    Args:
        listed: whether the address may be private. Metadata of clouds, multicast and no address at all stay refused.
    """
    inner = _embedded(address)
    if inner is not None and not listed and address not in NAT64:
        # No name of the public network leads to such an address; it is a way around filters of IPv4 addresses.
        return "it leads to an IPv4-mapped address"
    if inner is not None:
        return why_refused(inner, listed=listed)
    if address in NOBODY:
        return "it leads to a cloud's metadata"
    if address.is_multicast or address.is_unspecified or address == IPv4Address("255.255.255.255"):
        return "it leads to no single computer"
    return "" if listed or _is_public(address) else "it leads to a private address"


def _is_public(address: Address) -> bool:
    if isinstance(address, IPv6Address) and any(address in network for network in TRANSLATED):
        return False
    return address.is_global and not address.is_reserved


def _embedded(address: Address) -> IPv4Address | None:
    """Returns the IPv4 address to which an IPv6 address leads on every computer; None if it leads to none."""
    if not isinstance(address, IPv6Address):
        return None
    if address.ipv4_mapped is not None:
        return address.ipv4_mapped
    return IPv4Address(int(address) & 0xFFFFFFFF) if address in NAT64 else None
