"""A service that is killed with -9 while its store fails in every way loses no trace."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.service_archive import Campaign
from tests.server.archive.store import FaultyStore, ObjectStore


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_nothing_is_lost_by_kills_and_failures(store: ObjectStore, proxy: FaultyStore, tmp_path: Path) -> None:
    found = Campaign(tmp_path, store, proxy, seed=7).run(6)
    assert found.wrong == []
    assert found.kills == 6
    assert found.traces > 0
