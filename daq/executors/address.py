"""The URL of an executor, checked before anything is opened: local://4, dask://host:8786, slurm://partition."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args
from urllib.parse import parse_qsl, urlsplit

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError

Kind = Literal["local", "dask", "dask+tls", "slurm"]
KINDS: tuple[Kind, ...] = get_args(Kind)
LOCAL = "local://"
EXAMPLES = "local://4, dask://host:8786, dask://?workers=4 or slurm://partition?workers=20"
MOST_WORKERS = 10_000
DASK_PORT = 8786
OPTIONS: dict[Kind, dict[str, str]] = {
    "local": {},
    "dask": {"workers": r"\d+"},
    "dask+tls": {},
    "slurm": {
        "workers": r"\d+",
        "memory": r"\d+(\.\d+)?[KMGT]i?B",
        "walltime": r"(\d+-)?\d{1,2}:\d{2}(:\d{2})?",
        "account": r"[\w.-]+",
        "interface": r"[\w.-]+",
    },
}
"""The options of each kind, after the question mark, and the form of their values."""


@dataclass(frozen=True)
class Address:
    """A parsed URL.

    Args:
        place: number of processes, `host:port` of a scheduler, or partition; empty where the default is meant.
        options: what follows the question mark.
    """

    url: str
    kind: Kind
    place: str
    options: Mapping[str, str]

    @property
    def workers(self) -> int | None:
        """The number of workers to start, where the URL says it."""
        given = self.place if self.kind == "local" else self.options.get("workers", "")
        return int(given) if given else None


def parse_address(url: str) -> Address:
    """Raises SpecError, in one line, for a URL of no executor."""
    head = f"executor {shown(url)}"
    try:
        parts = urlsplit(url)
        given = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
        parts.port  # noqa: B018, reading it checks it
    except ValueError as error:
        raise SpecError(f"{head}: {error}; write {EXAMPLES}") from None
    kind = next((one for one in KINDS if one == parts.scheme), None)
    if kind is None or "://" not in url or parts.path.strip("/") or parts.fragment or parts.username is not None:
        raise SpecError(f"{head}: is none; write {EXAMPLES}")
    known = OPTIONS[kind]
    for name, value in given:
        if name not in known:
            allowed = f"it has {', '.join(known)}" if known else "it has none"
            raise SpecError(f"{head}: option {shown(name)} is not known; {allowed}")
        if not re.fullmatch(known[name], value, re.ASCII):
            raise SpecError(f"{head}: {name}={shown(value)} has another form than {name}={_EXAMPLE[name]}")
    if len(dict(given)) < len(given):
        raise SpecError(f"{head}: an option is given twice")
    found = Address(url, kind, _place(kind, parts.netloc, head), dict(given))
    if found.place and kind == "dask" and found.options:
        raise SpecError(f"{head}: workers= starts a cluster here, and the URL names a scheduler; leave one of them out")
    if found.workers is not None and not 1 <= found.workers <= MOST_WORKERS:
        raise SpecError(f"{head}: {found.workers} workers; 1 to {MOST_WORKERS} are possible")
    return found


def parse_service_address(url: str) -> Address:
    """Parses the URL of what computes for a service, which starts no scheduler: whoever reached its port could run any
    program as the service, and waiting for Slurm would hold up other jobs. Raises SpecError as `parse_address` does."""
    found = parse_address(url)
    if found.kind == "slurm" or (found.kind == "dask" and not found.place):
        line = f"executor {shown(url)}: a service starts no cluster; write local://, or a scheduler: dask://host:8786"
        raise SpecError(line)
    return found


def _place(kind: Kind, written: str, head: str) -> str:
    if kind == "local":
        if written and not re.fullmatch(r"\d+", written, re.ASCII):
            raise SpecError(f"{head}: write the number of processes, such as local://4, or local:// for one a core")
        return written
    if kind == "slurm":
        if not re.fullmatch(r"[\w.-]*", written):
            raise SpecError(f"{head}: write the partition, such as slurm://compute?workers=20")
        return written
    if kind == "dask+tls" and not written:
        raise SpecError(f"{head}: names no scheduler; write dask+tls://host:8786")
    if not written:
        return ""
    port = re.search(r":(\d+)$", written)
    return written if port else f"{written.rstrip(':')}:{DASK_PORT}"


_EXAMPLE = {"workers": "20", "memory": "4GB", "walltime": "02:00:00", "account": "robotics", "interface": "ib0"}
