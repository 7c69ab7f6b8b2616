"""Opens the executor of a batch by URL: local://4, dask://host:8786, dask+tls://host:8786."""

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
"""Port of Dask's scheduler if the URL has none."""
EXAMPLES = "write local://4 or dask://host:8786 or dask+tls://host:8786"


@dataclass(frozen=True)
class Address:
    """A parsed URL. `target`: number of processes (empty: one per core), or address of a scheduler."""

    url: str
    kind: str
    target: str


def parse_address(url: str) -> Address:
    """Parses a URL. Raises SpecError, in one line, if it is not that of an executor."""
    head = f"executor {shown(url)}"
    try:
        parts = urlsplit(url)
        port = parts.port
    except ValueError as error:
        raise SpecError(f"{head}: {error}; {EXAMPLES}") from None
    if "://" not in url or parts.path.strip("/") or parts.query or parts.fragment or parts.username is not None:
        raise SpecError(f"{head}: is not an executor URL; {EXAMPLES}")
    target = parts.netloc
    if parts.scheme == "local":
        if not re.fullmatch(r"\d*", target, re.ASCII):
            line = "write the number of processes, such as local://4, or local:// for one per core"
            raise SpecError(f"{head}: {line}")
        if target and not 1 <= int(target) <= MOST_WORKERS:
            raise SpecError(f"{head}: {target} workers; 1 to {MOST_WORKERS} are possible")
    elif parts.scheme in ("dask", "dask+tls"):
        if not target:
            raise SpecError(f"{head}: names no scheduler; {EXAMPLES}")
        target = target if port is not None else f"{target.rstrip(':')}:{PORT}"
    else:
        raise SpecError(f"{head}: is not an executor URL; {EXAMPLES}")
    return Address(url, parts.scheme, target)


def open_workers(url: str) -> Workers:
    """Opens the executor of a URL (docs/batches.md).

    Raises SpecError for another URL; MissingExtraError; ReachError for a scheduler that does not answer;
    OtherVersionError.
    """
    address = parse_address(url)
    if address.kind == "local":
        return LocalWorkers(int(address.target) if address.target else cores())
    require_extra("cluster", f"executor {url}", "distributed")
    from extras.lab.batches.dask import connected

    scheme = "tls" if address.kind == "dask+tls" else "tcp"
    return connected(url, f"{scheme}://{address.target}")
