"""The URL of an executor: what is understood, and what is refused in one line."""

import pytest

from daq.contracts.errors import SpecError
from daq.executors.address import parse_address, parse_service_address


@pytest.mark.parametrize(
    ("url", "kind", "place", "workers"),
    [
        ("local://4", "local", "4", 4),
        ("local://", "local", "", None),
        ("dask://host", "dask", "host:8786", None),
        ("dask://[::1]:9000", "dask", "[::1]:9000", None),
        ("dask://", "dask", "", None),
        ("dask://?workers=2", "dask", "", 2),
        ("dask+tls://host:8786", "dask+tls", "host:8786", None),
        ("slurm://compute?workers=20&memory=4GB&walltime=02:00:00", "slurm", "compute", 20),
        ("slurm://", "slurm", "", None),
    ],
)
def test_what_is_understood(url: str, kind: str, place: str, workers: int | None) -> None:
    found = parse_address(url)
    assert (found.kind, found.place, found.workers) == (kind, place, workers)


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("", "is none; write local://4"),
        ("4", "is none"),
        ("local", "is none"),
        ("ray://host", "is none"),
        ("local://four", "write the number of processes"),
        ("local://0", "0 workers; 1 to 10000"),
        ("local://4?memory=1GB", "option 'memory' is not known; it has none"),
        ("dask://host:port", "Port could not be cast"),
        ("dask://host/path", "is none"),
        ("dask://host?workers=4", "leave one of them out"),
        ("dask://somebody@host", "is none"),
        ("dask+tls://", "names no scheduler"),
        ("slurm://a b", "write the partition"),
        ("slurm://c?memory=lots", "another form than memory=4GB"),
        ("slurm://c?walltime=2h", "another form than walltime=02:00:00"),
        ("slurm://c?account=a;rm", "another form than account"),
        ("slurm://c?workers=1&workers=2", "given twice"),
        ("slurm://c?gpus=1", "option 'gpus' is not known; it has workers, memory"),
        ("http://[", "Invalid IPv6 URL"),
    ],
)
def test_what_is_refused(url: str, says: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_address(url)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("url", ["slurm://compute", "slurm://", "dask://", "dask://?workers=4"])
def test_a_service_starts_no_cluster(url: str) -> None:
    with pytest.raises(SpecError, match="a service starts no cluster; write local://, or a scheduler"):
        parse_service_address(url)
    assert parse_service_address("dask://host").place == "host:8786"
    assert parse_service_address("local://2").workers == 2
