"""What the line to a controller can give, as a status has it, and as people read it."""

import math

import pytest

from daq.contracts.service.robot import LinkStatus, RobotIdentity
from daq.driver.line_rate import told_rates
from daq.runner.line_status import rates_line, with_rates

LINK = LinkStatus(state="connected", counters={"requests": 7.0}, age=0.5)


def identity(**fields: bool) -> RobotIdentity:
    return RobotIdentity.model_validate({"simulated": True, "protocol": 2, "period": 0.02, "boots": 1} | fields)


@pytest.mark.parametrize(("baud", "compact"), [(115200, False), (19200, False), (19200, True)])
def test_a_status_has_the_rates_of_its_line_and_the_longest_time_of_a_stop(baud: int, compact: bool) -> None:
    found = with_rates(LINK, baud / 10, identity(compact=compact))
    rates = told_rates(baud / 10, 0.02, can_be_compact=compact)
    assert [(rate.joints, rate.every) for rate in found.rates] == [(rate.joints, rate.every) for rate in rates]
    assert [rate.samples_per_second for rate in found.rates] == [
        pytest.approx(50.0 / rate.every, abs=5e-4) for rate in rates
    ]
    assert [rate.share for rate in found.rates] == [pytest.approx(rate.share, abs=5e-4) for rate in rates]
    assert found.stop_seconds == pytest.approx(66 / (baud / 10) + 0.010)
    assert (found.state, found.counters, found.age) == ("connected", {"requests": 7.0}, 0.5), "the rest is as it was"


def test_a_bridge_that_does_not_see_the_control_period_is_promised_no_rate() -> None:
    found = with_rates(LINK, 1920.0, identity(samples=False))
    assert (found.rates, found.stop_seconds) == ((), pytest.approx(66 / 1920 + 0.010))
    assert rates_line(found) == ""


def test_one_line_tells_the_rates_and_the_stop() -> None:
    line = rates_line(with_rates(LINK, 1920.0, identity()))
    assert (
        line == "samples per second on this line: 1 joint 16.7, 3 joints 16.7, 6 joints 12.5; a stop takes up to 45 ms"
    )


def test_a_line_of_which_nothing_is_known_is_told_nothing_of() -> None:
    known = with_rates(LINK, 1920.0, identity())
    assert rates_line(LINK) == ""
    assert rates_line(known.model_copy(update={"stop_seconds": None})) == ""
    assert rates_line(known.model_copy(update={"rates": ()})) == ""


def test_a_line_without_a_limit_is_never_full() -> None:
    found = with_rates(LINK, math.inf, identity())
    assert [(rate.every, rate.share) for rate in found.rates] == [(1, 0.0)] * 3
    assert found.stop_seconds == 0.010
