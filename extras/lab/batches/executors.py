"""Who computes a batch, by URL: local://4, dask://host:8786, dask://?workers=4, slurm://partition?workers=20."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib import import_module
from urllib.parse import parse_qsl, urlsplit

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.contracts.extras import require_extra
from daq.executors import LocalWorkers, Workers, cores

LOCAL = "local://"
MOST_WORKERS = 10_000
PORT = 8786
"""Port of Dask's scheduler where the URL has none."""


@dataclass(frozen=True)
class Address:
    """A parsed URL.

    Args:
        place: number of processes, address of a scheduler, or partition; empty where the default is meant.
        options: what follows the question mark.
    """

    url: str
    kind: str
    place: str
    options: Mapping[str, str]

    @property
    def workers(self) -> int | None:
        """The number of workers to start, where the URL says it."""
        given = self.place if self.kind == "local" else self.options.get("workers", "")
        return int(given) if given else None


@dataclass(frozen=True)
class _Kind:
    """An executor: an example of its URL, its check, and the function "module:function" that opens it."""

    example: str
    checked: Callable[[Address], Address]
    opened: tuple[str, str] = ("", "")
    module: str = ""
    """A module of the extra `cluster` that it needs."""
    options: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    """The form of each option's value, as a regular expression, and an example of it."""


def parse_address(url: str) -> Address:
    """Parses a URL. Raises SpecError, in one line, for one of no executor."""
    head, examples = f"executor {shown(url)}", " or ".join(kind.example for kind in _KINDS.values())
    try:
        parts = urlsplit(url)
        given = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
        parts.port  # noqa: B018, reading it checks it
    except ValueError as error:
        raise SpecError(f"{head}: {error}; write {examples}") from None
    kind = _KINDS.get(parts.scheme)
    if kind is None or "://" not in url or parts.path.strip("/") or parts.fragment or parts.username is not None:
        raise SpecError(f"{head}: is none; write {examples}")
    for name, value in given:
        if name not in kind.options:
            allowed = f"it has {', '.join(kind.options)}" if kind.options else "it has none"
            raise SpecError(f"{head}: option {shown(name)} is not known; {allowed}")
        form, example = kind.options[name]
        if not re.fullmatch(form, value, re.ASCII):
            raise SpecError(f"{head}: {name}={shown(value)} has another form than {name}={example}")
    if len(dict(given)) < len(given):
        raise SpecError(f"{head}: an option is given twice")
    found = kind.checked(Address(url, parts.scheme, parts.netloc, dict(given)))
    if found.workers is not None and not 1 <= found.workers <= MOST_WORKERS:
        raise SpecError(f"{head}: {found.workers} workers; 1 to {MOST_WORKERS} are possible")
    return found


def open_workers(url: str) -> Workers:
    """Opens the executor of a URL (docs/batches.md).

    Raises SpecError for a URL of no executor; MissingExtraError; ReachError for a scheduler that does not answer;
    OtherVersionError.
    """
    address = parse_address(url)
    if address.kind == "local":
        return LocalWorkers(address.workers or cores())
    kind = _KINDS[address.kind]
    require_extra("cluster", f"executor {url}", kind.module)
    module, function = kind.opened
    workers: Workers = getattr(import_module(module), function)(address)
    return workers


def _local(address: Address) -> Address:
    if not re.fullmatch(r"\d*", address.place, re.ASCII):
        line = "write the number of processes, such as local://4, or local:// for one a core"
        raise SpecError(f"executor {shown(address.url)}: {line}")
    return address


def _dask(address: Address) -> Address:
    """A scheduler; without one, a cluster that is started here."""
    if address.place and address.options:
        line = "workers= starts a cluster here, and the URL names a scheduler; leave one of them out"
        raise SpecError(f"executor {shown(address.url)}: {line}")
    return _with_port(address)


def _dask_by_tls(address: Address) -> Address:
    if not address.place:
        raise SpecError(f"executor {shown(address.url)}: names no scheduler; write dask+tls://host:8786")
    return _with_port(address)


def _slurm(address: Address) -> Address:
    if not re.fullmatch(r"[\w.-]*", address.place):
        raise SpecError(f"executor {shown(address.url)}: write the partition, such as slurm://compute?workers=20")
    return address


def _with_port(address: Address) -> Address:
    if not address.place or re.search(r":(\d+)$", address.place):
        return address
    return replace(address, place=f"{address.place.rstrip(':')}:{PORT}")


_DASK = ("extras.lab.batches.dask", "dask_workers")
_KINDS = {
    "local": _Kind("local://4", _local),
    "dask": _Kind("dask://host:8786", _dask, _DASK, "distributed", {"workers": (r"\d+", "20")}),
    "dask+tls": _Kind("dask+tls://host:8786", _dask_by_tls, _DASK, "distributed"),
    "slurm": _Kind(
        "slurm://partition?workers=20",
        _slurm,
        ("extras.lab.batches.slurm", "slurm_workers"),
        "dask_jobqueue",
        {
            "workers": (r"\d+", "20"),
            "memory": (r"\d+(\.\d+)?[KMGT]i?B", "4GB"),
            "walltime": (r"(\d+-)?\d{1,2}:\d{2}(:\d{2})?", "02:00:00"),
            "account": (r"[\w.-]+", "robotics"),
            "interface": (r"[\w.-]+", "ib0"),
        },
    ),
}
