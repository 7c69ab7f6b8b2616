"""A service of a program's own: on a mock alone, and ended with its block."""

from pathlib import Path

import pytest

import ma2000
from daq.contracts.errors import SpecError


def test_a_port_that_is_no_mock_is_refused_before_anything_starts(tmp_path: Path) -> None:
    with pytest.raises(SpecError, match="runs on mock:// alone; for an arm, use `daq serve`"):
        ma2000.LocalService(tmp_path / "lab", "serial:///dev/ttyUSB0")
    assert not (tmp_path / "lab").exists()


@pytest.mark.slow
def test_a_local_service_answers_within_its_block_and_is_gone_after_it(tmp_path: Path) -> None:
    with ma2000.LocalService(tmp_path / "lab") as service, ma2000.Client(service.url) as client:
        assert [one.robot for one in client.robots()] == ["ma2000"]
        assert service.url in repr(service)
    assert "ended" in repr(service)
    with ma2000.Client(service.url) as client, pytest.raises(ma2000.DaqError):
        client.robots(within=1.0)
