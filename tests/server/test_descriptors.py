"""However few files a process may open, connections leave some for stops."""

import resource

import pytest

from server.steady import RESERVED, most_connections


@pytest.mark.parametrize(
    ("limit", "most"), [(64, 16), (1024, 496), (4096, 500), (20, 4), (resource.RLIM_INFINITY, 500)]
)
def test_connections_leave_files_for_stops(monkeypatch: pytest.MonkeyPatch, limit: int, most: int) -> None:
    set_to: list[tuple[int, int]] = []
    monkeypatch.setattr(resource, "getrlimit", lambda _: (16, limit))
    monkeypatch.setattr(resource, "setrlimit", lambda _, both: set_to.append(both))
    assert most_connections(500) == most
    assert set_to == [(limit, limit)]
    assert limit in (20, resource.RLIM_INFINITY) or limit - most >= RESERVED
