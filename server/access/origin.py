"""Recognises requests that a browser sends on behalf of another page. Pure.

A page from elsewhere can make a browser send requests here. It cannot hide its origin in requests that change
something. Nor can it hide the name by which it reached this service, if it uses a name of its own that it lets point to
this computer (DNS rebinding).
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
"""Headers that a proxy adds, besides all that begin with X-Forwarded-."""


def is_loopback(host: str) -> bool:
    """Whether an address or name is this computer's own."""
    if host in LOOPBACK_NAMES:
        return True
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


def name_of(host_header: str) -> str:
    """Returns the name in a Host header without its port, in lower case."""
    try:
        return (urlsplit(f"//{host_header}").hostname or "").lower()
    except ValueError:
        return ""


def is_known_name(host_header: str, names: Collection[str], *, loopback_only: bool) -> bool:
    """Whether a Host header names this service: by a loopback name or address, by one of `names`, or, unless the
    service listens on loopback only, by an address, or by any name if there are no `names`."""
    name = name_of(host_header)
    if is_loopback(name) or name in names:
        return True
    if loopback_only:
        return False
    if not names:
        return True  # tokens keep strangers out, and no browser adds one by itself
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_this_computers_user(headers: Mapping[str, str]) -> bool:
    """Whether a request that came over loopback is from this computer: it names a loopback host, and has no header of
    a proxy. `headers`: by name in lower case."""
    proxied = any(name in HANDED_ON or name.startswith("x-forwarded-") for name in headers)
    return is_loopback(name_of(headers.get("host", ""))) and not proxied


def beside(host_header: str, port: int) -> str | None:
    """Returns the origin at another port of the same host, under the name in the Host header; None if that is not
    valid."""
    name = name_of(host_header)
    if ":" in name:
        name = f"[{name}]"
    return f"http://{name}:{port}" if NAME.fullmatch(name) else None


def is_from_elsewhere(headers: Mapping[str, str], *, changes_something: bool) -> bool:
    """Whether a browser sends this for a page of another origin. Programs other than browsers send no origin."""
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
