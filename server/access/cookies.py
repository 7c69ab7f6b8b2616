"""The cookies of people who sign in. Pure, without web framework and database: the stop listener uses them, too.

Browsers do not tell the ports of a host apart in cookies. So the names have the port at which people reach the service:
two services on one host name then keep their sessions apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from urllib.parse import urlsplit

from server.access.origin import DEFAULT_PORTS

TLS_PREFIX = "__Host-"
"""Beginning of a name that browsers take from its host over TLS only. On loopback, names are without it."""
SESSION, SIGN_IN = "daq-session", "daq-sign-in"
STOPS_FOR = 3600.0
"""Time (s) for which an ended session still stops the robot, and nothing else: nobody shall find at the wrong moment
that they must sign in again. A session that somebody has left stops nothing."""


def session_cookie(address: str | None) -> str:
    """Returns the name of the session's cookie. `address`: where people reach the service (`server.address`);
    None where nobody signs in."""
    return _name(SESSION, address)


def sign_in_cookie(address: str | None) -> str:
    """Returns the name of the cookie that ties an answer of the provider to the browser that asked."""
    return _name(SIGN_IN, address)


def is_over_tls(address: str | None) -> bool:
    """Whether people reach the service over TLS."""
    return address is not None and urlsplit(address).scheme == "https"


def session_of(headers: Mapping[str, str], cookie: str) -> str:
    """Returns the secret of the session in the cookie of this name; empty if there is none. `headers`: by name in lower
    case."""
    pairs = [one.strip().partition("=") for one in headers.get("cookie", "").split(";")]
    return {name: value for name, _, value in pairs}.get(cookie, "")


def says_where_it_is_from(headers: Mapping[str, str]) -> bool:
    """Whether a browser says which page a request is for. All do where a request changes something; a request with a
    session that does not is none of our page's."""
    return "origin" in headers or "sec-fetch-site" in headers


def _name(name: str, address: str | None) -> str:
    if address is None:
        return name
    parts = urlsplit(address)
    prefix = TLS_PREFIX if is_over_tls(address) else ""
    return f"{prefix}{name}-{parts.port or DEFAULT_PORTS[parts.scheme]}"
