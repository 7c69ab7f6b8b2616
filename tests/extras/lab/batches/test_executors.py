"""The URLs of clusters: what is understood, and what is refused in one line."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.extras import MissingExtraError
from daq.executors.workers import OtherVersionError
from extras.lab.batches.executors import open_workers, parse_address
from extras.lab.batches.program import Checked, Program
from tests.daq.executors.by_hand import square


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
        ("http://[", "Invalid IPv6 URL"),
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
    ],
)
def test_what_is_refused(url: str, says: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_address(url)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)


def test_without_its_package_a_cluster_is_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtraError, match=r"executor dask://.*distributed.*\[cluster\]"):
        open_workers("dask://127.0.0.1:9")


def test_every_executor_of_the_page_is_understood() -> None:
    page = Path(__file__).parents[4].joinpath("docs", "batches.md").read_text("utf-8")
    urls = re.findall(r"`((?:local|dask|dask\+tls|slurm)://[^`]*)`", page)
    assert {parse_address(url).kind for url in urls} == {"local", "dask", "dask+tls", "slurm"}


def test_a_worker_of_another_version_is_refused_by_name() -> None:
    with pytest.raises(OtherVersionError, match=r"worker .*process \d+: has ma2000-daq .* and ma2000-daq 0\.0\.1 on "):
        Checked(square, Program("0.0.1", "3.9"))(2)
