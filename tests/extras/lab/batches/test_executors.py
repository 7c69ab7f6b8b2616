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
    ("url", "kind", "place"),
    [
        ("local://4", "local", "4"),
        ("local://", "local", ""),
        ("dask://host", "dask", "host:8786"),
        ("dask://[::1]:9000", "dask", "[::1]:9000"),
        ("dask+tls://host:8786", "dask+tls", "host:8786"),
    ],
)
def test_what_is_understood(url: str, kind: str, place: str) -> None:
    found = parse_address(url)
    assert (found.kind, found.place) == (kind, place)


@pytest.mark.parametrize(
    ("url", "says"),
    [
        ("", "is none; write local://4"),
        ("4", "is none"),
        ("local", "is none"),
        ("slurm://compute", "is none; write local://4 or dask://host:8786"),
        ("local://four", "write the number of processes"),
        ("local://0", "0 workers; 1 to 10000"),
        ("local://4?memory=1GB", "is none"),
        ("http://[", "Invalid IPv6 URL"),
        ("dask://host:port", "Port could not be cast"),
        ("dask://host/path", "is none"),
        ("dask://somebody@host", "is none"),
        ("dask://", "names no scheduler"),
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
    urls = re.findall(r"`((?:local|dask|dask\+tls)://[^`]*)`", page)
    assert {parse_address(url).kind for url in urls} == {"local", "dask", "dask+tls"}


def test_a_worker_of_another_version_is_refused_by_name() -> None:
    with pytest.raises(OtherVersionError, match=r"worker .*process \d+: has ma2000-daq .* and ma2000-daq 0\.0\.1 on "):
        Checked(square, Program("0.0.1", "3.9"))(2)
