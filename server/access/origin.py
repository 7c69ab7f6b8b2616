"""Detects requests that a browser sends on behalf of another page. Pure.

A foreign page can make a browser send requests here. It cannot hide its origin in requests that change something. It
also cannot hide the name by which it reached this service, even if it makes its own name point to this computer (DNS
rebinding).
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
"""Headers that a proxy adds, besides all X-Forwarded-…."""


def is_loopback(host: str) -> bool:
    """Whether an address or name is this computer's loopback."""
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
    """Returns the path below which a proxy serves this service, without a final slash; usually empty."""
    given = headers.get("x-forwarded-prefix", "").rstrip("/")
    return given if PREFIX.fullmatch(given) else ""


def is_known_name(host_header: str, names: Collection[str], *, loopback_only: bool) -> bool:
    """Whether a Host header names this service. Accepted are loopback names and addresses, and `names`; unless the
    service listens only on loopback, also any address, and any name if there are no `names`."""
    name = name_of(host_header)
    if is_loopback(name) or name in names:
        return True
    if loopback_only:
        return False
    if not names:
        return True  # tokens keep strangers out, and no browser adds a token by itself
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


def is_this_computers_user(headers: Mapping[str, str]) -> bool:
    """Whether a request over loopback is from this computer: it names a loopback host, and has neither a proxy's header
    nor the origin of a page behind a proxy. `headers`: by name in lower case."""
    proxied = any(name in HANDED_ON or name.startswith("x-forwarded-") for name in headers)
    page = place_of(headers.get("origin", "http://localhost"))
    return is_loopback(name_of(headers.get("host", ""))) and not proxied and page is not None and is_loopback(page[0])


def beside(host_header: str, port: int) -> str | None:
    """Returns the origin at another port of the same host, under the name in the Host header; None if the header is
    invalid."""
    name = name_of(host_header)
    if ":" in name:
        name = f"[{name}]"
    return f"http://{name}:{port}" if NAME.fullmatch(name) else None


def place_of(origin: str) -> tuple[str, int] | None:
    """Returns name and port of an origin, which omits the default port of its scheme; None if it has none."""
    try:
        page = urlsplit(origin)
        port = page.port or DEFAULT_PORTS.get(page.scheme)
    except ValueError:
        return None
    return None if port is None or page.hostname is None else (page.hostname, port)


def is_from_elsewhere(headers: Mapping[str, str], names: Collection[str] = (), *, changes_something: bool) -> bool:
    """Whether a browser sends this request for a page of another origin. Programs other than browsers send no origin.

    If a proxy has replaced the name in Host, the page's own name must be one of the service's `names`, at the default
    port of http or https: other ports of a name may belong to other people.
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
