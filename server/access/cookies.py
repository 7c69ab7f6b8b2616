"""Cookies of signed-in people, without web framework and database, since the stop listener uses this module too.

Browsers do not distinguish the ports of a host in cookies. The cookie names therefore contain the port at which people
reach the service, which separates the sessions of two services on one host.
"""

from __future__ import annotations

from collections.abc import Mapping
from urllib.parse import urlsplit

from server.access.origin import DEFAULT_PORTS

TLS_PREFIX = "__Host-"
"""Prefix of a cookie name that browsers accept from its host over TLS only. On loopback, names have no prefix."""
SESSION, SIGN_IN = "daq-session", "daq-sign-in"
STOPS_FOR = 3600.0
"""Time (s) for which an expired session may still stop the robot, and do nothing else: nobody should have to sign in
again before stopping the robot. A session that was signed out stops nothing."""


def session_cookie(address: str | None) -> str:
    """Returns the name of the session's cookie. `address`: where people reach the service (`server.address`); None if
    nobody signs in."""
    return _name(SESSION, address)


def sign_in_cookie(address: str | None) -> str:
    """Returns the name of the cookie that ties the provider's response to the browser that requested it."""
    return _name(SIGN_IN, address)


def is_over_tls(address: str | None) -> bool:
    """Whether people reach the service over TLS."""
    return address is not None and urlsplit(address).scheme == "https"


def session_of(headers: Mapping[str, str], cookie: str) -> str:
    """Returns the session's secret in the cookie of this name; empty if there is none. `headers`: by name in lower
    case."""
    pairs = [one.strip().partition("=") for one in headers.get("cookie", "").split(";")]
    return {name: value for name, _, value in pairs}.get(cookie, "")


def says_where_it_is_from(headers: Mapping[str, str]) -> bool:
    """Whether the headers state from which page the request comes. All browsers state it in requests that change
    something. A request with a session cookie and without these headers therefore does not come from our page."""
    return "origin" in headers or "sec-fetch-site" in headers


def _name(name: str, address: str | None) -> str:
    if address is None:
        return name
    parts = urlsplit(address)
    prefix = TLS_PREFIX if is_over_tls(address) else ""
    return f"{prefix}{name}-{parts.port or DEFAULT_PORTS[parts.scheme]}"
