"""The URLs of clusters: dask://host:8786, dask://?workers=4, dask+tls://host:8786, slurm://partition?workers=20."""

from __future__ import annotations

import re
from dataclasses import replace

from daq.contracts.documents import shown
from daq.contracts.errors import SpecError
from daq.executors.address import Address

PORT = 8786
"""Port of Dask's scheduler where the URL has none."""


def dask(address: Address) -> Address:
    """A scheduler; without one, a cluster that is started here. Raises SpecError."""
    if address.place and address.options:
        line = "workers= starts a cluster here, and the URL names a scheduler; leave one of them out"
        raise SpecError(f"executor {shown(address.url)}: {line}")
    return replace(_with_port(address), starts_cluster=not address.place)


def dask_by_tls(address: Address) -> Address:
    """A scheduler that is reached by TLS. Raises SpecError."""
    if not address.place:
        raise SpecError(f"executor {shown(address.url)}: names no scheduler; write dask+tls://host:8786")
    return _with_port(address)


def slurm(address: Address) -> Address:
    """A partition. Raises SpecError."""
    if not re.fullmatch(r"[\w.-]*", address.place):
        raise SpecError(f"executor {shown(address.url)}: write the partition, such as slurm://compute?workers=20")
    return replace(address, starts_cluster=True)


def _with_port(address: Address) -> Address:
    if not address.place or re.search(r":(\d+)$", address.place):
        return address
    return replace(address, place=f"{address.place.rstrip(':')}:{PORT}")
