"""The cookie of a person who has signed in. Pure, and without the web framework: the stop listener uses it, too."""

from __future__ import annotations

from collections.abc import Mapping

OVER_TLS, PLAIN = "__Host-daq-session", "daq-session"
"""Names of the cookie. With the first one browsers take it from this host over TLS only; the second is for loopback."""
STOPS_FOR = 3600.0
"""Time (s) for which an ended session still stops the robot, and nothing else: nobody shall find at the wrong moment
that they must sign in again. A session that somebody has left stops nothing."""


def session_of(headers: Mapping[str, str]) -> str:
    """Returns the secret of the session in a request's cookies; empty if there is none. `headers`: by name in lower
    case."""
    pairs = [one.strip().partition("=") for one in headers.get("cookie", "").split(";")]
    found = {name: value for name, _, value in pairs}
    return found.get(OVER_TLS) or found.get(PLAIN) or ""


def says_where_it_is_from(headers: Mapping[str, str]) -> bool:
    """Whether a browser says which page a request is for. All do where a request changes something; a request with a
    session that does not is none of our page's."""
    return "origin" in headers or "sec-fetch-site" in headers
