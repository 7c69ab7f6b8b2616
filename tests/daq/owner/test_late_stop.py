"""A stop that could not be delivered is delivered when the link comes back."""

import pytest

from daq.driver import Controller
from daq.link import LinkError
from daq.owner.late_stop import deliver_late_stop
from tests.mock.process.running import RunningMock


def test_the_arm_is_frozen_when_the_link_comes_back_in_time() -> None:
    with (
        RunningMock("--tcp", "127.0.0.1:0", "--lock-step") as mock,
        Controller.connect(f"{mock.url}?lock_step=1") as arm,
    ):
        mock.control("disconnect")
        with pytest.raises(LinkError):
            arm.status()
        # The first delay is the moment in which somebody pushes the plug back in.
        line = deliver_late_stop(arm, 60.0, sleep=lambda _seconds: reconnect(mock))
        assert "the link came back" in line
        assert "the board confirmed" in line
        assert mock.control("state")["frozen"] is True


def test_a_link_that_stays_away_is_said_so() -> None:
    with (
        RunningMock("--tcp", "127.0.0.1:0", "--lock-step") as mock,
        Controller.connect(f"{mock.url}?lock_step=1") as arm,
    ):
        mock.end()
        with pytest.raises(LinkError):
            arm.status()
        assert deliver_late_stop(arm, 0.0).startswith("the link did not come back within 0 s")


def reconnect(mock: RunningMock) -> None:
    mock.control("reconnect")
