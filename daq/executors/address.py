"""The URL of an executor, checked before anything is opened: local://4, or that of a plug-in."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import parse_qsl, urlsplit

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.plugins import Executor, named, plugins

LOCAL = "local://"
MOST_WORKERS = 10_000


@dataclass(frozen=True)
class Address:
    """A parsed URL.

    Args:
        place: number of processes, or what a plug-in's executor has there; empty where the default is meant.
        options: what follows the question mark.
        starts_cluster: whether opening it starts a scheduler, which a service does not.
    """

    url: str
    kind: str
    place: str
    options: Mapping[str, str]
    starts_cluster: bool = False

    @property
    def workers(self) -> int | None:
        """The number of workers to start, where the URL says it."""
        given = self.place if self.kind == "local" else self.options.get("workers", "")
        return int(given) if given else None


def executors() -> dict[str, Executor]:
    """The executors of plug-ins, by kind."""
    return {executor.kind: executor for plugin in plugins() for executor in plugin.executors}


def parse_address(url: str) -> Address:
    """Raises SpecError, in one line, for a URL of no executor."""
    head, known = f"executor {shown(url)}", executors()
    examples = " or ".join(["local://4", *(executor.example for executor in known.values())])
    try:
        parts = urlsplit(url)
        given = parse_qsl(parts.query, keep_blank_values=True, strict_parsing=bool(parts.query))
        parts.port  # noqa: B018, reading it checks it
    except ValueError as error:
        raise SpecError(f"{head}: {error}; write {examples}") from None
    kind = parts.scheme if parts.scheme == "local" or parts.scheme in known else None
    if kind is None or "://" not in url or parts.path.strip("/") or parts.fragment or parts.username is not None:
        raise SpecError(f"{head}: is none; write {examples}")
    options = {} if kind == "local" else known[kind].options
    for name, value in given:
        if name not in options:
            allowed = f"it has {', '.join(options)}" if options else "it has none"
            raise SpecError(f"{head}: option {shown(name)} is not known; {allowed}")
        form, example = options[name]
        if not re.fullmatch(form, value, re.ASCII):
            raise SpecError(f"{head}: {name}={shown(value)} has another form than {name}={example}")
    if len(dict(given)) < len(given):
        raise SpecError(f"{head}: an option is given twice")
    if kind == "local" and not re.fullmatch(r"\d*", parts.netloc, re.ASCII):
        raise SpecError(f"{head}: write the number of processes, such as local://4, or local:// for one a core")
    found = Address(url, kind, parts.netloc, dict(given))
    if kind != "local":
        found = named(known[kind].checked)(found)
    if found.workers is not None and not 1 <= found.workers <= MOST_WORKERS:
        raise SpecError(f"{head}: {found.workers} workers; 1 to {MOST_WORKERS} are possible")
    return found


def parse_service_address(url: str) -> Address:
    """Parses the URL of what computes for a service, which starts no scheduler: whoever reached its port could run any
    program as the service, and waiting for one would hold up other jobs. Raises SpecError as `parse_address` does."""
    found = parse_address(url)
    if found.starts_cluster:
        raise SpecError(f"executor {shown(url)}: a service starts no cluster; write local://, or a running scheduler")
    return found
