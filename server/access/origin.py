"""What a browser may not do on behalf of another page. Pure.

A page from elsewhere can make a browser send requests here. It cannot hide its origin in those that change something,
and not the name by which it reached this service: a name of its own that it lets point to this computer (rebinding).
"""

from __future__ import annotations

import ipaddress
import re
from collections.abc import Collection, Mapping
from urllib.parse import urlsplit

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
NAME = re.compile(r"[a-z0-9.-]+|\[[0-9a-f:.]+\]")
LOOPBACK_NAMES = ("localhost", "localhost.localdomain")
HANDED_ON = ("forwarded", "via", "x-real-ip")
"""Headers of a proxy, and each that begins with X-Forwarded-."""


def is_loopback(host: str) -> bool:
    """Whether an address or name is this computer's own."""
    if host in LOOPBACK_NAMES:
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def name_of(host_header: str) -> str:
    """The name in a Host header, without port, in small letters."""
    try:
        return (urlsplit(f"//{host_header}").hostname or "").lower()
    except ValueError:
        return ""


def is_known_name(host_header: str, names: Collection[str], *, loopback_only: bool) -> bool:
    """Whether this service is meant: a loopback name or address, or one of `names`; an address where others listen."""
    name = name_of(host_header)
    if is_loopback(name) or name in names:
        return True
    if loopback_only:
        return False
    if not names:
        return True  # tokens keep strangers out, and no browser sends one along by itself
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_this_computers_user(headers: Mapping[str, str]) -> bool:
    """Whether a request that came over loopback is from this computer: it asks for a loopback name, and no proxy says
    that it has handed it on. `headers` by name in small letters."""
    proxied = any(name in HANDED_ON or name.startswith("x-forwarded-") for name in headers)
    return is_loopback(name_of(headers.get("host", ""))) and not proxied


def beside(host_header: str, port: int) -> str | None:
    """The origin at another port of the same computer, under the name by which it was reached; None for a name that is
    none."""
    name = name_of(host_header)
    if ":" in name:
        name = f"[{name}]"
    return f"http://{name}:{port}" if NAME.fullmatch(name) else None


def is_from_elsewhere(headers: Mapping[str, str], *, changes_something: bool) -> bool:
    """Whether a browser sends this for a page of another origin. Programs say nothing, and are not browsers."""
    if not changes_something:
        return False
    if headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
        return True
    origin = headers.get("origin")
    if origin is None:
        return False
    try:
        return urlsplit(origin).netloc.lower() != headers.get("host", "").lower()
    except ValueError:
        return True
