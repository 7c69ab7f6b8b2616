"""The URL of an executor: what is understood, and what is refused in one line."""

import pytest

from daq.contracts.errors import SpecError
from daq.executors.address import parse_address, parse_service_address


@pytest.mark.parametrize(("url", "place", "workers"), [("local://4", "4", 4), ("local://", "", None)])
def test_what_is_understood(url: str, place: str, workers: int | None) -> None:
    found = parse_address(url)
    assert (found.kind, found.place, found.workers) == ("local", place, workers)
    assert parse_service_address(url) == found


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
    ],
)
def test_what_is_refused(url: str, says: str) -> None:
    with pytest.raises(SpecError) as refused:
        parse_address(url)
    assert says in str(refused.value)
    assert "\n" not in str(refused.value)
