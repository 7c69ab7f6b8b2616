"""Posts messages to a webhook, signed as "Standard Webhooks" 1.0 says (https://www.standardwebhooks.com)."""

from __future__ import annotations

import asyncio
import base64
import binascii
import hashlib
import hmac
import ssl
from collections.abc import Callable, Collection
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path

import httpx

from daq.contracts.documents import read_text
from daq.contracts.errors import SpecError
from extras.lab.notifications.addresses import Address, Resolver, addresses_of, resolve
from extras.lab.notifications.delivery import DeliveryError, Message
from extras.lab.notifications.settings import WebhookSettings

WITHIN = 20.0
"""Time (s) for an attempt, from the connection to the status of the answer, whose body is not read."""
SECRET_PREFIX = "whsec_"
SHORTEST_SECRET, LONGEST_SECRET = 24, 64
"""Sizes (bytes) of a secret, as the specification demands them."""
LONGEST_PAUSE = 86_400.0
GONE = 410


def load_secret(file: Path) -> bytes:
    """Reads a secret. Raises SpecError, which repeats none of it."""
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
    """Returns the header `webhook-signature`: HMAC-SHA256 of identity, time (s since 1970) and payload."""
    signed = hmac.new(secret, f"{identity}.{timestamp}.{payload}".encode(), hashlib.sha256)
    return f"v1,{base64.b64encode(signed.digest()).decode()}"


class Webhook:
    """One webhook. Every attempt resolves its host once, checks the addresses, and connects to one of these."""

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
            raise SpecError(f"notifications: the url of a webhook at {settings.host} is no address") from None
        # Everything is read from this one parsed address: two parsers may see two hosts in one text.
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
            # Neither a proxy nor a password of the surroundings: either would undo the checks of the address.
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
        # The certificate is checked against the name, although the connection goes to the address that was checked.
        request = client.build_request(
            "POST",
            self._url.copy_with(host=str(address)),
            content=message.payload.encode(),
            headers=headers,
            extensions={"sni_hostname": self._host},
        )
        answer = await client.send(request, stream=True)
        await answer.aclose()  # its body may be endless, and tells nobody anything
        return answer.status_code, answer.headers


def _kind_of(error: Exception) -> str:
    """Returns what went wrong, in words of ours: an error's text may repeat an answer's."""
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
    """Returns the time of a header `Retry-After` in s; None if it has none, or a date."""
    return min(float(text), LONGEST_PAUSE) if text is not None and text.isascii() and text.isdecimal() else None
