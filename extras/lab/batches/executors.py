"""Who computes a batch, by URL: local://4, dask://host:8786, dask+tls://host:8786."""

from __future__ import annotations

import re
from dataclasses import dataclass
from urllib.parse import urlsplit

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.contracts.extras import require_extra
from daq.executors import LocalWorkers, Workers, cores

LOCAL = "local://"
MOST_WORKERS = 10_000
PORT = 8786
"""Port of Dask's scheduler where the URL has none."""
EXAMPLES = "write local://4 or dask://host:8786 or dask+tls://host:8786"


@dataclass(frozen=True)
class Address:
    """A parsed URL. `place`: number of processes (empty: one a core), or address of a scheduler."""

    url: str
    kind: str
    place: str


def parse_address(url: str) -> Address:
    """Parses a URL. Raises SpecError, in one line, for one of no executor."""
    head = f"executor {shown(url)}"
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise SpecError(f"{head}: {error}; {EXAMPLES}") from None
    if "://" not in url or parts.path.strip("/") or parts.query or parts.fragment or parts.username is not None:
        raise SpecError(f"{head}: is none; {EXAMPLES}")
    place = parts.netloc
    if parts.scheme == "local":
        if not re.fullmatch(r"\d*", place, re.ASCII):
            line = "write the number of processes, such as local://4, or local:// for one a core"
            raise SpecError(f"{head}: {line}")
        if place and not 1 <= int(place) <= MOST_WORKERS:
            raise SpecError(f"{head}: {place} workers; 1 to {MOST_WORKERS} are possible")
    elif parts.scheme in ("dask", "dask+tls"):
        if not place:
            raise SpecError(f"{head}: names no scheduler; {EXAMPLES}")
        place = place if port is not None else f"{place.rstrip(':')}:{PORT}"
    else:
        raise SpecError(f"{head}: is none; {EXAMPLES}")
    return Address(url, parts.scheme, place)


def open_workers(url: str) -> Workers:
    """Opens the executor of a URL (docs/batches.md).

    Raises SpecError for a URL of no executor; MissingExtraError; ReachError for a scheduler that does not answer;
    OtherVersionError.
    """
    address = parse_address(url)
    if address.kind == "local":
        return LocalWorkers(int(address.place) if address.place else cores())
    require_extra("cluster", f"executor {url}", "distributed")
    from extras.lab.batches.dask import connected

    scheme = "tls" if address.kind == "dask+tls" else "tcp"
    return connected(url, f"{scheme}://{address.place}")
