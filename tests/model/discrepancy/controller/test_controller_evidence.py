"""The controller's own numbers prove a wrong gain and lost set points, and nothing else."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.contracts.machine import Machine, SampledPid
from daq.contracts.quantity import Quantity
from daq.contracts.trace import Trace
from model.discrepancy.controller.evidence import (
    check_controller,
    settled_by_records,
    with_findings,
    with_used_set_points,
)
from tests.model.fitting import imagined

SENSOR = imagined.machine().joint(1).sensor
UNIT = SENSOR.range.value / 2**SENSOR.bits


@pytest.fixture(scope="module")
def sound() -> Trace:
    """A record with the controller's numbers as the board writes them."""
    made = imagined.trace(imagined.arm())
    assert made.error is not None
    return with_power(with_used_set_points(made), made.error, 1.0)  # as the board rounds them


def with_power(given: Trace, error: NDArray[np.float64], factor: float) -> Trace:
    """The record with this error, and the power that P = 2 times `factor` makes of it."""
    power = np.clip(np.round(factor * 2.0 * error / UNIT), -127, 127).astype(np.int64)
    return imagined.changed(given, error=error, power_raw=power)


@pytest.mark.parametrize("factor", [0.9, 1.05, 1.3])
def test_a_wrong_gain_is_measured(sound: Trace, factor: float) -> None:
    assert sound.error is not None
    found = check_controller([with_power(sound, sound.error, factor)], imagined.machine())
    assert [f.effect for f in found] == ["wrong_gain"] * 3
    for finding in found:
        assert finding.low <= factor - 1 <= finding.high
        assert finding.value == pytest.approx(factor - 1, abs=0.01)


BOTH, LOST = ("wrong_gain", "lost_set_points"), ("lost_set_points",)


def with_gains(given: Trace, gains: tuple[int, int, int]) -> Trace:
    """The record as one of a controller with other gains."""
    record = given.record.model_copy(update={"gains": dict.fromkeys(given.joints, gains)})
    return imagined.changed(given, record=record)


def shortened(given: Trace, samples: int) -> Trace:
    """The first samples of a record."""
    signals = ("time", "position", "set_point", "error", "drive", "power_raw", "tick")
    return imagined.changed(given, **{name: getattr(given, name)[:samples] for name in signals})


def at_rest(given: Trace, joint: int) -> Trace:
    """The record with a joint that is not asked to move and stands where it should."""
    assert given.set_point is not None
    assert given.error is not None
    assert given.power_raw is not None
    signals = {name: getattr(given, name).copy() for name in ("position", "set_point", "error", "power_raw")}
    for name, signal in signals.items():
        signal[:, joint - 1] = signal[0, joint - 1] if name in ("position", "set_point") else 0
    signals["set_point"][:, joint - 1] = signals["position"][:, joint - 1]
    return imagined.changed(given, **signals)


def sampled() -> Machine:
    """The arm with a controller of another law than the record's: it damps."""
    second = Quantity(value=imagined.PERIOD, unit="s", source="test")
    none = Quantity(value=0.0, unit="s", source="test")
    other = SampledPid(kind="pid", period=second, delay=none, gains=((500.0, 0.0, 30.0),) * 6)
    return imagined.machine().model_copy(update={"controller": other})


SETTLED: dict[str, tuple[Callable[[Trace], list[Trace]], tuple[str, ...]]] = {
    "all numbers": (lambda sound: [sound], BOTH),
    "all numbers, twice": (lambda sound: [sound, sound], BOTH),
    "no records": (lambda _: [], ()),
    "I acts": (lambda sound: [with_gains(sound, (2, 1, 0))], LOST),
    "D acts": (lambda sound: [with_gains(sound, (2, 0, 3))], LOST),
    "more than P acts in one of two": (lambda sound: [sound, with_gains(sound, (2, 1, 3))], LOST),
    "a few samples": (lambda sound: [shortened(sound, 19)], LOST),
    "a few samples beside many": (lambda sound: [sound, shortened(sound, 19)], BOTH),
    "a joint at rest": (lambda sound: [at_rest(sound, 3)], LOST),
    "a joint at rest in one of two": (lambda sound: [at_rest(sound, 3), sound], BOTH),
    "no errors": (lambda sound: [imagined.changed(sound, error=None)], ()),
    "no powers": (lambda sound: [imagined.changed(sound, power_raw=None)], LOST),
    "no powers in one of two": (lambda sound: [sound, imagined.changed(sound, power_raw=None)], LOST),
}


@pytest.mark.parametrize("shown", SETTLED)
def test_records_settle_what_every_joint_shows_in_enough_samples(sound: Trace, shown: str) -> None:
    records, settled = SETTLED[shown]
    assert settled_by_records(records(sound), imagined.machine()) == settled
    assert check_controller(records(sound), imagined.machine()) == ()


def test_another_controller_is_not_judged(sound: Trace) -> None:
    assert "wrong_gain" not in settled_by_records([sound], sampled())
    assert check_controller([sound], sampled()) == ()


def test_wrong_errors_while_no_set_point_moves_do_not_settle_lost_set_points(sound: Trace) -> None:
    still = at_rest(sound, 2)
    error = still.error.copy()
    error[:, 1] += 10 * UNIT
    judged = settled_by_records([with_power(still, error, 1.0)], imagined.machine())
    assert "lost_set_points" not in judged
    assert not any(f.effect == "lost_set_points" for f in check_controller([still], imagined.machine()))


def test_a_gain_error_that_the_model_states_is_not_found_again(sound: Trace) -> None:
    assert sound.error is not None
    record = with_power(sound, sound.error, 1.3)
    arm = imagined.arm()
    better = with_findings(arm, check_controller([record], imagined.machine(), arm))
    assert [p.name for p in better.parameters if p.effect == "wrong_gain"] == [
        f"joint{j}.wrong_gain.relative" for j in (1, 2, 3)
    ]
    assert check_controller([record], imagined.machine(), better) == ()


def test_a_wrong_gain_error_in_the_model_is_corrected(sound: Trace) -> None:
    assert sound.error is not None
    stated = imagined.arm().with_effect("wrong_gain", (1, 2, 3), {"relative": 0.3})
    found = check_controller([with_power(sound, sound.error, 1.5)], imagined.machine(), stated)
    assert [f.value for f in found] == pytest.approx([0.5] * 3, abs=0.01)
    sound_again = check_controller([sound], imagined.machine(), stated)
    assert [f.value for f in sound_again] == pytest.approx([0.0] * 3, abs=0.01)
    for findings, gain in ((found, 0.5), (sound_again, 0.0)):
        changed = with_findings(stated, findings)
        assert changed.effects == stated.effects
        assert changed.parameter("joint2.wrong_gain.relative").value == pytest.approx(gain, abs=0.01)


def test_a_gain_error_is_added_beside_that_of_another_joint(sound: Trace) -> None:
    assert sound.error is not None
    stated = imagined.arm().with_effect("wrong_gain", (2,), {"relative": 0.3})
    found = check_controller([with_power(sound, sound.error, 1.3)], imagined.machine(), stated)
    assert [f.joint for f in found] == [1, 3]
    changed = with_findings(stated, found)
    assert changed.parameter("joint2.wrong_gain.relative").value == 0.3
    assert changed.parameter("joint3.wrong_gain.relative").value == pytest.approx(0.3, abs=0.01)


def test_a_gain_error_that_joints_share_is_set_for_all_of_them(sound: Trace) -> None:
    assert sound.error is not None
    stated = imagined.arm().with_effect("wrong_gain", (1, 2, 3), shared=True)
    found = check_controller([with_power(sound, sound.error, 1.3)], imagined.machine(), stated)
    changed = with_findings(stated, found)
    assert changed.effects == stated.effects
    assert check_controller([with_power(sound, sound.error, 1.3)], imagined.machine(), changed) == ()
