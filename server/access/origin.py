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
DEFAULT_PORTS = {"http": 80, "https": 443}
PREFIX = re.compile(r"(/[A-Za-z0-9._~-]{1,64}){1,8}")
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


def prefix_of(headers: Mapping[str, str]) -> str:
    """Returns the path below which a proxy serves this service, without a slash at its end; mostly empty."""
    given = headers.get("x-forwarded-prefix", "").rstrip("/")
    return given if PREFIX.fullmatch(given) else ""


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
    a proxy, nor the origin of a page that came by one. `headers`: by name in lower case."""
    proxied = any(name in HANDED_ON or name.startswith("x-forwarded-") for name in headers)
    page = place_of(headers.get("origin", "http://localhost"))
    return is_loopback(name_of(headers.get("host", ""))) and not proxied and page is not None and is_loopback(page[0])


def beside(host_header: str, port: int) -> str | None:
    """Returns the origin at another port of the same host, under the name in the Host header; None if that is not
    valid."""
    name = name_of(host_header)
    if ":" in name:
        name = f"[{name}]"
    return f"http://{name}:{port}" if NAME.fullmatch(name) else None


def place_of(origin: str) -> tuple[str, int] | None:
    """Returns name and port of an origin, which leaves out the usual port of its scheme; None if it has none."""
    try:
        page = urlsplit(origin)
        port = page.port or DEFAULT_PORTS.get(page.scheme)
    except ValueError:
        return None
    return None if port is None or page.hostname is None else (page.hostname, port)


def is_from_elsewhere(headers: Mapping[str, str], names: Collection[str] = (), *, changes_something: bool) -> bool:
    """Whether a browser sends this for a page of another origin. Programs other than browsers send no origin.

    Where a proxy has put another name into Host, the page's own must be one of the service's `names`, at the usual port
    of http or https: other ports of a name may be other people's.
    """
    if not changes_something:
        return False
    if headers.get("sec-fetch-site", "same-origin") not in ("same-origin", "none"):
        return True
    origin = headers.get("origin")
    if origin is None:
        return False
    scheme, page, host = origin.partition(":")[0], place_of(origin), headers.get("host", "")
    if page is None or page == place_of(f"{scheme}://{host}"):
        return page is None
    return page[0] == name_of(host) or page[0] not in names or page[1] != DEFAULT_PORTS.get(scheme)
