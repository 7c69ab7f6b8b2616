"""Which set points a controller worked with, told by its drive: a third of the time it stands at its limit."""

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.controller.evidence import (
    ControllerFinding,
    check_controller,
    settled_by_records,
    with_used_set_points,
)
from model.discrepancy.controller.sampled import with_errors
from tests.model.discrepancy import outside_arm
from tests.model.imported import imported

PERIOD = outside_arm.PERIOD
BOTH = {"wrong_gain", "lost_set_points"}
PHASES = (Phase.explicit, Phase.generate)
"""A smaller case of a record is no clearer one, and every case takes a third of a second."""


@dataclass(frozen=True)
class Loop:
    """A PID of one joint, written out here.

    Args:
        gains: P (V/rad), I, D. limit, step: of its output, V. lost: share of the set points that it does not get.
        winds_up: whether it sums errors at its limit as well.
    """

    gains: tuple[float, float, float] = (110.0, 0.0, 5.0)
    limit: float = math.inf
    step: float = 0.14
    lost: float = 0.0
    winds_up: bool = False

    def used(self, sent: Floats, seed: int) -> Floats:
        """The set points (k,) that arrive: the last one where one is lost."""
        lost = np.random.default_rng(seed + 50).random(len(sent)) < self.lost
        lost[0] = False
        return sent[np.maximum.accumulate(np.where(lost, 0, np.arange(len(sent))))]

    def outputs(self, used: Floats, position: Floats) -> Floats:
        """Its drive (k,) for these set points and positions."""
        p, i, d = self.gains
        total, last, found = 0.0, float(used[0] - position[0]), []
        for error in (used - position).tolist():
            summed = total + error * PERIOD
            output = p * error + i * summed + d * (error - last) / PERIOD
            last = error
            if self.step:
                output = self.step * round(output / self.step)
            if self.winds_up or abs(output) < self.limit * (1 - 1e-9):
                total = summed
            found.append(min(max(output, -self.limit), self.limit))
        return np.array(found)


def motion(seed: int, count: int) -> tuple[Floats, Floats]:
    """Set points and positions (k,), which are behind by two waves, with noise of half a count."""
    sent = outside_arm.wanted(seed, count * PERIOD)[:, 1]
    draw = np.random.default_rng(seed + 10)
    time = PERIOD * np.arange(count)
    behind = 0.03 * np.sin(2.1 * time + draw.uniform(0, 6)) + 0.02 * np.sin(6.7 * time + draw.uniform(0, 6))
    read = outside_arm.COUNT * np.round((sent - behind) / outside_arm.COUNT + 0.5 * draw.standard_normal(count))
    return sent, np.asarray(read)


def limited(loop: Loop, seed: int, count: int, share: float = 1 / 3) -> Loop:
    """The same controller with a limit, a whole number of steps, at which its drive stands about that share."""
    sent, position = motion(seed, count)
    size = float(np.quantile(np.abs(replace(loop, step=0.0).outputs(sent, position)), 1 - share))
    return replace(loop, limit=loop.step * max(8.0, np.round(size / loop.step)))


def recorded(loop: Loop, seed: int, count: int = 600) -> tuple[Trace, float]:
    """A record of a joint with this controller, and the share of its set points that were lost."""
    sent, position = motion(seed, count)
    used = loop.used(sent, seed)
    drive = loop.outputs(used, position)
    record = imported(f"made-{seed}", period=PERIOD, drive_unit="V")
    moved = np.abs(np.diff(sent, prepend=sent[0])) > 3 * outside_arm.COUNT
    share = float((used != sent)[moved].sum() / max(1, moved.sum()))
    time: Floats = np.arange(count, dtype=np.float64) * PERIOD
    return Trace(record, (1,), time, position[:, None], set_point=sent[:, None], drive=drive[:, None]), share


def machine_of(loop: Loop, *, stated: bool = True) -> Machine:
    """The arm with this controller, and one joint alone. stated: whether its file states the step and the limit."""
    written = outside_arm.machine().model_dump(mode="json", exclude_none=True)
    controller: dict[str, Any] = written["controller"]
    controller["gains"] = [list(loop.gains)]
    del controller["drive_resolution"], controller["output_limit"]
    if stated:
        controller["drive_resolution"] = {"value": loop.step, "unit": "V", "source": "test"}
        if math.isfinite(loop.limit):
            controller["output_limit"] = {"value": loop.limit, "unit": "V", "source": "test"}
    written["modelled_joints"], written["joints"] = [1], written["joints"][:1]
    written["joints"][0]["drive"]["dac_full_scale"]["value"] = 1e4
    return Machine.model_validate(written)


def checked(trace: Trace, machine: Machine) -> tuple[ControllerFinding, ...]:
    return check_controller(with_errors([trace], machine), machine)


@pytest.mark.parametrize("stated", [True, False], ids=["stated", "read from the record"])
@pytest.mark.parametrize(
    "loop",
    [Loop(lost=0.1), Loop(gains=(80.0, 60.0, 0.0), lost=0.1), Loop(gains=(80.0, 60.0, 3.0), lost=0.1, winds_up=True)],
    ids=["PD", "PI", "PID that winds up"],
)
def test_lost_set_points_are_counted_though_the_drive_stands_at_its_limit_a_third_of_the_time(
    loop: Loop, stated: bool
) -> None:
    bounded = limited(loop, 3, 800)
    trace, lost = recorded(bounded, 3, 800)
    assert 0.25 < np.mean(np.abs(trace.drive[:, 0]) >= bounded.limit) < 0.5
    found = checked(trace, machine_of(bounded, stated=stated))
    assert [(f.effect, f.joint) for f in found] == [("lost_set_points", 1)]
    assert found[0].low <= lost <= found[0].high
    assert found[0].value == pytest.approx(lost, abs=0.03)


@settings(max_examples=6, phases=PHASES)
@given(seed=st.integers(1, 500), lost=st.floats(0.05, 0.15), p=st.floats(60.0, 150.0), share=st.floats(0.0, 0.3))
def test_of_any_controller_nothing_but_its_lost_set_points_is_proved_to_a_factor_of_two(
    seed: int, lost: float, p: float, share: float
) -> None:
    """At its limit a drive hides some of them, which count as arrived; slow ones differ by about its step."""
    loop = limited(Loop(gains=(p, 0.0, 0.03 * p), lost=lost), seed, 500, share)
    trace, true = recorded(loop, seed, 500)
    found = checked(trace, machine_of(loop))
    assert {f.effect for f in found} <= {"lost_set_points"}
    assert all(0.5 * true - 0.03 < f.value < 2.0 * true + 0.03 for f in found)


@settings(max_examples=12, phases=PHASES)
@given(
    seed=st.integers(1, 500),
    gains=st.tuples(st.floats(40.0, 200.0), st.sampled_from([0.0, 20.0, 90.0]), st.sampled_from([0.0, 1.0, 6.0])),
    share=st.floats(0.0, 0.4),
    winds_up=st.booleans(),
    stated=st.booleans(),
)
def test_a_sound_controller_proves_nothing(
    seed: int, gains: tuple[float, float, float], share: float, winds_up: bool, stated: bool
) -> None:
    loop = limited(Loop(gains=gains, winds_up=winds_up), seed, 400, share)
    trace, lost = recorded(loop, seed, 400)
    assert lost == 0.0
    machine = machine_of(loop, stated=stated)
    assert checked(trace, machine) == ()


@pytest.mark.parametrize("winds_up", [False, True])
@pytest.mark.parametrize("stated", [True, False])
def test_a_sound_controller_at_its_limit_settles_its_effects(winds_up: bool, stated: bool) -> None:
    loop = limited(Loop(gains=(80.0, 60.0, 3.0), winds_up=winds_up), 5, 800)
    machine = machine_of(loop, stated=stated)
    trace, _ = recorded(loop, 5, 800)
    assert set(settled_by_records(with_errors([trace], machine), machine)) == BOTH


def test_set_points_in_use_are_told_wherever_they_make_a_difference() -> None:
    loop = limited(Loop(lost=0.15), 7, 800)
    machine = machine_of(loop)
    trace, _ = recorded(loop, 7, 800)
    restored = with_used_set_points(with_errors([trace], machine)[0])
    free = np.abs(trace.drive[:, 0]) < loop.limit
    true = loop.used(trace.set_point[:, 0], 7)
    told = loop.step / loop.gains[0]
    wrong = np.abs(restored.set_point[:, 0] - true)[free] > 2 * told
    assert wrong.mean() < 0.01
    assert (np.abs(trace.set_point[:, 0] - true)[free] > 2 * told).mean() > 0.04, "many were lost"
