"""Every other kind of trajectory: its shape, its ends, its marks."""

import math

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.experiment import Path
from daq.trajectories.set_points import Plan
from tests.daq.trajectories.machines import PERIOD, UNIT, motion


def offsets(planned: Plan, joint: int = 1) -> np.ndarray:
    column = planned.angles[:, joint - 1]
    return column - column[0]


def marked(planned: Plan, kind: str) -> list[int]:
    return [mark.index for mark in planned.marks if mark.kind == kind]


def test_step_is_one_jump() -> None:
    planned = motion(joints=(1,), trajectory={"kind": "step", "amplitude": 0.05})
    assert offsets(planned) == pytest.approx([0, 0.05])
    assert planned.jumps.tolist() == [False, True]


def test_staircase_goes_up_and_down_in_equal_steps_and_dwells_on_each() -> None:
    planned = motion(joints=(1,), trajectory={"kind": "staircase", "amplitude": 0.3, "steps": 3, "dwell": 0.04})
    assert offsets(planned) == pytest.approx([0, 0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.2, 0.2, 0.1, 0.1, 0, 0])
    assert planned.jumps.tolist() == [False] + [True, False] * 6
    assert marked(planned, "reversal") == [6]


def test_staircase_that_does_not_come_back_ends_at_the_amplitude() -> None:
    move = {"kind": "staircase", "amplitude": -0.3, "steps": 3, "dwell": 0.02, "back": False}
    planned = motion(joints=(1,), trajectory=move)
    assert offsets(planned) == pytest.approx([0, -0.1, -0.2, -0.3])
    assert marked(planned, "reversal") == []


@pytest.mark.parametrize(("reversals", "end"), [(0, 0.1), (1, 0.0), (2, 0.1), (3, 0.0)])
def test_slow_ramp_has_constant_speed_and_turns_as_often_as_asked(reversals: int, end: float) -> None:
    move = {"kind": "slow_ramp", "amplitude": 0.1, "speed": 0.05, "reversals": reversals}
    planned = motion(joints=(1,), trajectory=move)
    speed = np.diff(offsets(planned)) / PERIOD
    assert np.abs(speed) == pytest.approx(0.05)
    assert int((np.diff(np.sign(speed)) != 0).sum()) == reversals
    assert offsets(planned)[-1] == pytest.approx(end)
    assert marked(planned, "reversal") == [100 * turn for turn in range(1, reversals + 1)]


def test_slow_ramp_turns_all_joints_at_once_the_widest_at_the_speed_asked_for() -> None:
    planned = motion(joints=(1, 2), trajectory={"kind": "slow_ramp", "amplitude": {1: 0.05, 2: -0.1}, "speed": 0.05})
    assert offsets(planned, 1) == pytest.approx(-offsets(planned, 2) / 2)
    assert np.abs(np.diff(offsets(planned, 2))).max() == pytest.approx(0.05 * PERIOD)


def test_a_mark_of_a_reversal_lies_on_the_first_set_point_after_it() -> None:
    planned = motion(joints=(1,), trajectory={"kind": "slow_ramp", "amplitude": 0.1, "speed": 0.07, "reversals": 1})
    (index,) = marked(planned, "reversal")
    around = offsets(planned)[index - 2 : index + 2]
    assert around[0] < around[1]
    assert around[2] > around[3]


def test_slow_ramp_of_no_amplitude_stands_still() -> None:
    planned = motion(joints=(1,), trajectory={"kind": "slow_ramp", "amplitude": 0.0})
    assert not offsets(planned).any()


def test_sine_is_about_the_start_and_ends_where_it_began() -> None:
    planned = motion(joints=(1,), trajectory={"kind": "sine", "amplitude": 0.2, "period": 2.0, "cycles": 3})
    time = np.arange(301) * PERIOD
    assert offsets(planned) == pytest.approx(0.2 * np.sin(math.pi * time), abs=1e-12)


@pytest.mark.parametrize("phase", [math.pi / 2, -math.pi / 2])
def test_a_lag_starts_later_and_never_jumps(phase: float) -> None:
    move = {"kind": "sine", "amplitude": 0.2, "period": 2.0, "cycles": 2, "phase": phase}
    planned = motion(joints=(1, 2), trajectory=move)
    first, second = (1, 2) if phase > 0 else (2, 1)
    assert offsets(planned, second)[25:] == pytest.approx(offsets(planned, first)[:-25])
    assert np.abs(np.diff(planned.angles, axis=0)).max() <= 0.2 * math.pi * PERIOD


def test_multisine_stays_within_its_amplitude_and_reaches_it() -> None:
    planned = motion(joints=(1, 2), trajectory={"kind": "multisine", "amplitude": {1: 0.2, 2: 0.1}})
    assert np.abs(offsets(planned, 1)).max() == pytest.approx(0.2)
    assert np.abs(offsets(planned, 2)).max() == pytest.approx(0.1)


def test_multisine_is_faded_in_and_out() -> None:
    edge = offsets(motion(joints=(1,), trajectory={"kind": "multisine", "amplitude": 0.2}))
    assert np.abs(edge[:5]).max() < 0.2 * 0.01
    assert np.abs(edge[-5:]).max() < 0.2 * 0.01


def test_multisine_has_only_the_frequencies_asked_for() -> None:
    move = {"kind": "multisine", "duration": 40.0, "lowest": 0.5, "highest": 2.0, "tones": 4}
    signal = offsets(motion(joints=(1,), trajectory=move))[:-1]
    power = np.abs(np.fft.rfft(signal)) ** 2
    frequency = np.fft.rfftfreq(len(signal), PERIOD)
    inside = (frequency > 0.4) & (frequency < 2.1)
    assert power[inside].sum() > 0.99 * power.sum()


def test_multisine_repeats_to_the_bit_and_changes_with_the_seed() -> None:
    first, again, other = (
        motion(joints=(1,), trajectory={"kind": "multisine", "seed": seed}).angles for seed in (7, 7, 8)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_leaving_a_joint_out_of_a_multisine_does_not_change_the_others() -> None:
    both = motion(joints=(1, 2), trajectory={"kind": "multisine"})
    alone = motion(joints=(2,), trajectory={"kind": "multisine"})
    assert np.array_equal(both.angles[:, 1], alone.angles[:, 1])


def test_cubic_is_at_rest_at_both_ends_and_half_way_at_half_time() -> None:
    rise = offsets(motion(joints=(1,), trajectory={"kind": "cubic", "amplitude": 0.4, "duration": 1.0}))
    assert rise[25] == pytest.approx(0.2)
    assert rise[-1] == pytest.approx(0.4)
    assert np.diff(rise)[[0, -1]] == pytest.approx(3 * 0.4 * PERIOD**2, rel=0.02)
    assert np.diff(rise).max() / PERIOD == pytest.approx(1.5 * 0.4, rel=1e-3)


def test_path_is_absolute_and_linear_between_its_points() -> None:
    path = Path(times=(0.0, 0.1, 0.2), positions=((3.0, 1.0), (3.1, 0.9), (3.0, 1.0)))
    planned = motion(joints=(1, 2), trajectory=path)
    assert planned.angles[1:, 0] == pytest.approx(3.0 + 0.1 * (1 - np.abs(1 - np.arange(1, 11) / 5)))
    assert planned.angles[0, :2] == pytest.approx([3.0, 1.0], abs=UNIT / 2)


def test_path_from_elsewhere_is_refused_with_both_places() -> None:
    path = Path(times=(0.0, 0.1), positions=((3.0,), (3.1,)))
    spec = {"joints": (1,), "trajectory": path, "start": {1: 2.0}}
    with pytest.raises(SpecError, match=r"joint 1: the path starts at 171\.89°, the arm stands at 114\.\d+°"):
        motion(**spec)


def test_ragged_path_is_refused() -> None:
    path = Path(times=(0.0, 0.1), positions=((3.0, 1.0), (3.1, 1.0)))
    ragged = path.model_copy(update={"positions": ((3.0, 1.0), (3.1,))})
    with pytest.raises(SpecError, match="path: row 2 has 1 angles, the experiment has 2 joints"):
        motion(joints=(1, 2), trajectory=ragged)


def test_sequence_goes_on_from_where_each_piece_ended_on_its_own_joints() -> None:
    segments = [
        {"move": {"kind": "ramp", "amplitude": 0.1, "duration": 0.1}, "joints": (1,)},
        {"move": {"kind": "pause", "duration": 0.1}},
        {"move": {"kind": "ramp", "amplitude": -0.2, "duration": 0.1}},
    ]
    planned = motion(joints=(1, 2), trajectory={"kind": "sequence", "segments": segments})
    assert offsets(planned, 1)[[5, 10, 15]] == pytest.approx([0.1, 0.1, -0.1])
    assert offsets(planned, 2)[[5, 10, 15]] == pytest.approx([0.0, 0.0, -0.2])
    marks = [(mark.kind, mark.index, mark.joint) for mark in planned.marks]
    assert marks == [
        ("start", 0, None),
        ("ramp_start", 0, 1),
        ("ramp_end", 5, 1),
        ("ramp_start", 10, None),
        ("ramp_end", 15, None),
        ("end", 15, None),
    ]
