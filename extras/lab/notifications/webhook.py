"""Posts messages to a webhook, signed by "Standard Webhooks" 1.0 (https://www.standardwebhooks.com).

A webhook may reach public addresses, and those of hosts that the configuration lists. It makes the service send
requests from inside the laboratory's network, so a wrong or hostile address could reach hosts that outsiders cannot
(server-side request forgery; the rules follow OWASP's cheat sheet of that name). A name is resolved once per attempt,
and the connection uses the checked address. So a name that changes its address in between (DNS rebinding) has no
effect.
"""

from __future__ import annotations

import asyncio
import base64
import binascii
import csv
import hashlib
import hmac
import socket
import ssl
from collections.abc import Callable, Collection, Iterable
from datetime import UTC, datetime
from functools import cache
from importlib import resources
from importlib.metadata import version
from ipaddress import IPv4Address, IPv4Network, IPv6Address, IPv6Network, ip_address, ip_network
from pathlib import Path

import httpx

from daq.contracts.documents import read_text
from daq.contracts.errors import SpecError
from extras.lab.notifications.delivery import DeliveryError, Message
from extras.lab.notifications.settings import WebhookSettings

Address = IPv4Address | IPv6Address
Resolver = Callable[[str, int], Iterable[str]]
BROADCAST = IPv4Address("255.255.255.255")
MOST_ADDRESSES = 8
"""Most addresses of a name that are checked."""
METADATA = tuple(
    map(ip_network, ("169.254.0.0/16", "100.100.100.200", "168.63.129.16", "fd00:ec2::/32", "fd20:ce::254"))
)
"""Addresses at which clouds give a computer its own keys: Amazon, Google, Azure, Oracle and OpenStack (link-local, and
their own of version 6), Alibaba, Azure's agent."""
GLOBAL_UNICAST = IPv6Network("2000::/3")
"""The block of assigned IPv6 addresses (RFC 4291, and IANA's registry of the address space)."""
ENDS_WITH_IPV4 = tuple(map(IPv6Network, ("::/96", "::ffff:0:0/96", "::ffff:0:0:0/96", "64:ff9b::/96")))
"""Blocks whose last four bytes are an IPv4 address: compatible (RFC 4291), mapped, translated (RFC 2765), NAT64."""
LOCAL_NAT64 = IPv6Network("64:ff9b:1::/48")
LOCAL_NAT64_BYTES = ((6, 7, 9, 10), (7, 9, 10, 11), (9, 10, 11, 12), (12, 13, 14, 15))
"""Positions of the bytes of an IPv4 address, for prefixes of 48, 56, 64 and 96 bits (RFC 6052)."""
ISATAP = (b"\x00\x00\x5e\xfe", b"\x02\x00\x5e\xfe")
"""Bytes 8 to 11 of an address that a router splits into the IPv4 address in the last four (RFC 5214)."""


class RefusedAddressError(DeliveryError):
    """A webhook's host has an address that is not allowed."""


def resolve(host: str, port: int) -> Iterable[str]:
    """Returns the addresses of a host, from the computer's resolver. Raises OSError."""
    found = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    return dict.fromkeys(str(place[4][0]) for place in found)


def addresses_of(host: str, port: int, *, listed: bool, resolver: Resolver = resolve) -> list[Address]:
    """Returns the addresses to connect to.

    Raises DeliveryError for a name that cannot be resolved, and RefusedAddressError if any of its addresses is not
    allowed.

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
    """Returns why an address may not be used; an empty text if it may.

    Args:
        listed: whether the address may be private. Cloud metadata, multicast and unspecified addresses are always
            refused.
    """
    leads_to = (address, *_embedded(address))
    if any(one in network for one in leads_to for network in METADATA):
        return "it leads to a cloud's metadata"
    # If an address has several readings (NAT64 with a local prefix), only its owner knows the right one.
    sure = leads_to if len(leads_to) <= 2 else leads_to[:1]
    if any(one.is_multicast or one.is_unspecified or one == BROADCAST for one in sure):
        return "it leads to no single computer"
    return "" if listed or all(map(_is_public, leads_to)) else "it leads to a private address"


def _is_public(address: Address) -> bool:
    """Whether IANA's table lists it as public. Python's own (`is_global`) is as old as the interpreter."""
    found = [(network.prefixlen, reachable) for network, reachable in _special() if address in network]
    if found:
        return max(found)[1]
    return isinstance(address, IPv4Address) or address in GLOBAL_UNICAST


@cache
def _special() -> tuple[tuple[IPv4Network | IPv6Network, bool], ...]:
    text = (resources.files(__package__) / "special_addresses.csv").read_text("utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return tuple((ip_network(row["address_block"]), row["globally_reachable"] == "True") for row in rows)


def _embedded(address: Address) -> list[IPv4Address]:
    """Returns the IPv4 addresses to which an IPv6 address may lead, on some computer or router."""
    if not isinstance(address, IPv6Address):
        return []
    packed = address.packed
    found = [packed[12:]] if packed[8:12] in ISATAP or any(address in network for network in ENDS_WITH_IPV4) else []
    if address in LOCAL_NAT64:
        found += [bytes(packed[place] for place in places) for places in LOCAL_NAT64_BYTES]
    if address.sixtofour is not None:
        found.append(address.sixtofour.packed)
    if address.teredo is not None:  # the relay and the client
        found += [one.packed for one in address.teredo]
    return [IPv4Address(one) for one in found]


WITHIN = 20.0
"""Time (s) for an attempt, from the connection to the status of the answer, whose body is not read."""
SECRET_PREFIX = "whsec_"
SHORTEST_SECRET, LONGEST_SECRET = 24, 64
"""Sizes (bytes) of a secret, as the specification requires."""
LONGEST_PAUSE = 86_400.0
GONE = 410


def load_secret(file: Path) -> bytes:
    """Reads a secret. Raises SpecError, without repeating any of it."""
    what = f"notifications: secret {file}"
    text = read_text(file, what).strip()
    try:
        secret = base64.b64decode(text.removeprefix(SECRET_PREFIX), validate=True)
    except (binascii.Error, ValueError):
        secret = b""
    if not text.startswith(SECRET_PREFIX) or not SHORTEST_SECRET <= len(secret) <= LONGEST_SECRET:
        raise SpecError(f"{what}: write {SECRET_PREFIX} and {SHORTEST_SECRET} to {LONGEST_SECRET} bytes as base64")
    return secret


def signature_of(secret: bytes, identity: str, timestamp: int, payload: str) -> str:
    """Returns the header `webhook-signature`: HMAC-SHA256 of ID, time (s since 1970) and payload."""
    signed = hmac.new(secret, f"{identity}.{timestamp}.{payload}".encode(), hashlib.sha256)
    return f"v1,{base64.b64encode(signed.digest()).decode()}"


class Webhook:
    """One webhook. Every attempt resolves its host once, checks the addresses, and connects to one of them."""

    def __init__(
        self,
        settings: WebhookSettings,
        *,
        private_hosts: Collection[str] = (),
        resolver: Resolver = resolve,
        trust: ssl.SSLContext | None = None,
        utc: Callable[[], datetime] = lambda: datetime.now(UTC),
        within: float = WITHIN,
    ) -> None:
        try:
            self._url = httpx.URL(settings.url.get_secret_value())
        except httpx.InvalidURL:
            raise SpecError(f"notifications: the URL of a webhook at {settings.host} is invalid") from None
        # Everything is read from this one parsed URL: two parsers may see two hosts in one text.
        self._host = self._url.raw_host.decode("ascii")
        self._port = self._url.port or (443 if self._url.scheme == "https" else 80)
        self._listed = self._host in {host.lower() for host in private_hosts}
        if self._url.scheme != "https" and not (self._listed and self._url.scheme == "http"):
            raise SpecError(f"notifications: webhook at {self._host}: write https, or list it in private_hosts")
        self._secret = load_secret(settings.secret)
        self._resolver = resolver
        self._trust = trust
        self._utc = utc
        self._within = within

    def send(self, message: Message) -> str:
        """Posts a message. Returns the status of the answer. Raises DeliveryError."""
        addresses = addresses_of(self._host, self._port, listed=self._listed, resolver=self._resolver)
        try:
            status, headers = asyncio.run(self._post(message, addresses))
        except TimeoutError as error:
            raise DeliveryError(f"{self._host}: no answer within {self._within:g} s") from error
        except (httpx.HTTPError, httpx.InvalidURL, ssl.SSLError) as error:
            raise DeliveryError(f"{self._host}: {_kind_of(error)}") from error
        if 200 <= status < 300:
            return f"answered {status}"
        line = f"{self._host}: answered {status}"
        if 300 <= status < 400:
            line += ", which leads elsewhere and is not followed"
        raise DeliveryError(line, for_good=status == GONE, retry_after=_seconds(headers.get("retry-after")))

    async def _post(self, message: Message, addresses: list[Address]) -> tuple[int, httpx.Headers]:
        async with asyncio.timeout(self._within):
            # Neither a proxy nor a password of the environment is used: either would bypass the checks of the address.
            async with httpx.AsyncClient(
                verify=self._trust or ssl.create_default_context(),
                trust_env=False,
                follow_redirects=False,
                timeout=self._within,
            ) as client:
                for address in addresses[:-1]:
                    try:
                        return await self._ask(client, message, address)
                    except httpx.ConnectError:
                        continue  # a computer without IPv6, for example, cannot reach the first one
                return await self._ask(client, message, addresses[-1])

    async def _ask(self, client: httpx.AsyncClient, message: Message, address: Address) -> tuple[int, httpx.Headers]:
        timestamp = int(self._utc().timestamp())
        headers = {
            "Host": self._url.netloc.decode("ascii"),
            "Content-Type": "application/json",
            "User-Agent": f"ma2000-daq/{version('ma2000-daq')}",
            "Accept-Encoding": "identity",
            "webhook-id": message.id,
            "webhook-timestamp": str(timestamp),
            "webhook-signature": signature_of(self._secret, message.id, timestamp, message.payload),
        }
        # The certificate is checked against the name, although the connection uses the checked address.
        request = client.build_request(
            "POST",
            self._url.copy_with(host=str(address)),
            content=message.payload.encode(),
            headers=headers,
            extensions={"sni_hostname": self._host},
        )
        answer = await client.send(request, stream=True)
        await answer.aclose()  # its body may be endless, and is not needed
        return answer.status_code, answer.headers


def _kind_of(error: Exception) -> str:
    """Returns the kind of an error, in words of this program: an error's text may repeat an answer's."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, ssl.SSLError):
        cause = cause.__cause__ or cause.__context__
    if cause is not None:
        return "its certificate is not valid, or it does not speak TLS"
    if isinstance(error, httpx.TimeoutException):
        return "did not answer in time"
    if isinstance(error, httpx.ConnectError):
        return "cannot be connected to"
    return "the connection failed"


def _seconds(text: str | None) -> float | None:
    """Returns the time of a header `Retry-After` in s; None without one, or for a date."""
    return min(float(text), LONGEST_PAUSE) if text is not None and text.isascii() and text.isdecimal() else None
