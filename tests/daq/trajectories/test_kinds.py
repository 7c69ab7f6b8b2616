"""Every kind of trajectory: its shape, its ends, its marks; and the named experiments made of them."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.experiment import (
    Cubic,
    ExperimentSpec,
    Multisine,
    Path,
    Ramp,
    Sine,
    SlowRamp,
    Staircase,
    Step,
    Trajectory,
)
from daq.safety import check_plan
from daq.trajectories.planner import plan, start_angles
from daq.trajectories.presets import PRESETS, preset
from daq.trajectories.set_points import Plan
from tests.daq.trajectories.machines import MA2000, PERIOD, UNIT, motion, planned


def test_a_ramp_has_equal_increments_and_ends_together_at_rest() -> None:
    # Increments are equal but the last which is the rest of the line
    plan = motion(joints=(1,))
    increments = np.diff(plan.angles[:, 0])
    assert len(increments) == 33
    assert increments[:-1] == pytest.approx(80 * UNIT * PERIOD / 0.65)
    assert increments[-1] == pytest.approx(80 * UNIT * PERIOD / 0.65 / 2)
    # All joints arrive together whatever their amplitudes
    plan = motion(trajectory={"kind": "ramp", "amplitude": {1: 0.3, 2: -0.1, 3: 0.02}, "duration": 0.5})
    fraction = (plan.angles[:, :3] - plan.angles[0, :3]) / [0.3, -0.1, 0.02]
    assert fraction == pytest.approx(np.repeat(np.linspace(0, 1, 26)[:, None], 3, axis=1))
    # A ramp of one period is one set point and a shorter one is none
    assert len(motion(trajectory={"kind": "ramp", "duration": PERIOD, "amplitude": 0.01})) == 2
    with pytest.raises(SpecError, match=r"ramp: duration: 0.019 s is too short"):
        motion(trajectory={"kind": "ramp", "duration": 0.019, "amplitude": 0.01})
    # Settle and hold stand still on both sides
    plan = planned(settle=0.5, hold=2.0)
    kinds = {mark.kind: mark.index for mark in plan.marks}
    assert kinds == {"start": 0, "ramp_start": 25, "ramp_end": 58, "end": 158}
    assert (plan.postures[:26] == plan.postures[0]).all()
    assert (plan.postures[26, :3] > plan.postures[0, :3]).all()
    assert (plan.postures[58:] == plan.postures[-1]).all()
    assert plan.duration == pytest.approx(3.16)


# ---- Every other kind of trajectory: its shape, its ends, its marks


def offsets(planned: Plan, joint: int = 1) -> np.ndarray:
    column = planned.angles[:, joint - 1]
    return column - column[0]


def marked(planned: Plan, kind: str) -> list[int]:
    return [mark.index for mark in planned.marks if mark.kind == kind]


def test_a_step_is_one_jump_and_a_staircase_dwells_on_each_of_equal_steps() -> None:
    planned = motion(joints=(1,), trajectory={"kind": "step", "amplitude": 0.05})
    assert offsets(planned) == pytest.approx([0, 0.05])
    assert planned.jumps.tolist() == [False, True]
    assert (marked(planned, "ramp_start"), marked(planned, "ramp_end")) == ([0], [1])
    planned = motion(joints=(1,), trajectory={"kind": "staircase", "amplitude": 0.3, "steps": 3, "dwell": 0.04})
    assert offsets(planned) == pytest.approx([0, 0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.2, 0.2, 0.1, 0.1, 0, 0])
    assert planned.jumps.tolist() == [False] + [True, False] * 6
    assert [marked(planned, kind) for kind in ("ramp_start", "reversal", "ramp_end")] == [[0], [6], [12]]
    move = {"kind": "staircase", "amplitude": -0.3, "steps": 3, "dwell": 0.02, "back": False}
    planned = motion(joints=(1,), trajectory=move)
    assert offsets(planned) == pytest.approx([0, -0.1, -0.2, -0.3])
    assert marked(planned, "reversal") == []


@pytest.mark.parametrize(("reversals", "end"), [(0, 0.1), (1, 0.0), (2, 0.1), (3, 0.0)])
def test_slow_ramp_has_constant_speed_and_turns_all_joints_as_often_as_asked(reversals: int, end: float) -> None:
    move = {"kind": "slow_ramp", "amplitude": {1: 0.1, 2: -0.05}, "speed": 0.05, "reversals": reversals}
    planned = motion(joints=(1, 2), trajectory=move)
    assert offsets(planned, 2) == pytest.approx(-offsets(planned, 1) / 2)
    speed = np.diff(offsets(planned)) / PERIOD
    assert np.abs(speed) == pytest.approx(0.05)
    assert int((np.diff(np.sign(speed)) != 0).sum()) == reversals
    assert offsets(planned)[-1] == pytest.approx(end)
    assert marked(planned, "reversal") == [100 * turn for turn in range(1, reversals + 1)]


def test_a_sine_and_a_cubic_begin_and_end_at_rest() -> None:
    planned = motion(joints=(1,), trajectory={"kind": "sine", "amplitude": 0.2, "period": 2.0, "cycles": 3})
    time = np.arange(301) * PERIOD
    assert offsets(planned) == pytest.approx(0.2 * np.sin(math.pi * time), abs=1e-12)
    rise = offsets(motion(joints=(1,), trajectory={"kind": "cubic", "amplitude": 0.4, "duration": 1.0}))
    assert rise[25] == pytest.approx(0.2)
    assert rise[-1] == pytest.approx(0.4)
    assert np.diff(rise)[[0, -1]] == pytest.approx(3 * 0.4 * PERIOD**2, rel=0.02)
    assert np.diff(rise).max() / PERIOD == pytest.approx(1.5 * 0.4, rel=1e-3)


@pytest.mark.parametrize("phase", [math.pi / 2, -math.pi / 2])
def test_a_lag_starts_later_and_never_jumps(phase: float) -> None:
    move = {"kind": "sine", "amplitude": 0.2, "period": 2.0, "cycles": 2, "phase": phase}
    planned = motion(joints=(1, 2), trajectory=move)
    first, second = (1, 2) if phase > 0 else (2, 1)
    assert offsets(planned, second)[25:] == pytest.approx(offsets(planned, first)[:-25])
    assert np.abs(np.diff(planned.angles, axis=0)).max() <= 0.2 * math.pi * PERIOD


def test_a_multisine_reaches_its_amplitude_is_faded_and_repeats_to_the_bit() -> None:
    # Multisine stays within its amplitude and reaches it
    planned = motion(joints=(1, 2), trajectory={"kind": "multisine", "amplitude": {1: 0.2, 2: 0.1}})
    assert np.abs(offsets(planned, 1)).max() == pytest.approx(0.2)
    assert np.abs(offsets(planned, 2)).max() == pytest.approx(0.1)
    # Multisine is faded in and out
    edge = offsets(motion(joints=(1,), trajectory={"kind": "multisine", "amplitude": 0.2}))
    assert np.abs(edge[:5]).max() < 0.2 * 0.01
    assert np.abs(edge[-5:]).max() < 0.2 * 0.01
    # Multisine has only the frequencies asked for
    move = {"kind": "multisine", "duration": 40.0, "lowest": 0.5, "highest": 2.0, "tones": 4}
    signal = offsets(motion(joints=(1,), trajectory=move))[:-1]
    power = np.abs(np.fft.rfft(signal)) ** 2
    frequency = np.fft.rfftfreq(len(signal), PERIOD)
    inside = (frequency > 0.4) & (frequency < 2.1)
    assert power[inside].sum() > 0.99 * power.sum()
    # Multisine repeats to the bit and changes with the seed
    first, again, other = (
        motion(joints=(1,), trajectory={"kind": "multisine", "seed": seed}).angles for seed in (7, 7, 8)
    )
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    # Leaving a joint out of a multisine does not change the others
    both = motion(joints=(1, 2), trajectory={"kind": "multisine"})
    alone = motion(joints=(2,), trajectory={"kind": "multisine"})
    assert np.array_equal(both.angles[:, 1], alone.angles[:, 1])


def test_a_multisine_completes_a_hundredth_of_its_lowest_period_at_least() -> None:
    slow = {"kind": "multisine", "amplitude": 0.1, "duration": 10.0, "highest": 1.0, "tones": 3}
    assert len(motion(joints=(1,), trajectory=slow | {"lowest": 0.0011})) == 501
    with pytest.raises(SpecError, match=r"less than a hundredth of its period fits into 10 s: allowed are 0\.001 Hz"):
        motion(joints=(1,), trajectory=slow | {"lowest": 0.0009})


def test_a_path_is_absolute_and_refused_from_elsewhere() -> None:
    path = Path(times=(0.0, 0.1, 0.2), positions=((3.0, 1.0), (3.1, 0.9), (3.0, 1.0)))
    planned = motion(joints=(1, 2), trajectory=path)
    assert planned.angles[1:, 0] == pytest.approx(3.0 + 0.1 * (1 - np.abs(1 - np.arange(1, 11) / 5)))
    assert planned.angles[0, :2] == pytest.approx([3.0, 1.0], abs=UNIT / 2)
    path = Path(times=(0.0, 0.1), positions=((3.0,), (3.1,)))
    spec = {"joints": (1,), "trajectory": path, "start": {1: 2.0}}
    with pytest.raises(SpecError, match=r"joint 1: the path starts at 171\.89°, the arm stands at 114\.\d+°"):
        motion(**spec)
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


# ---- Named experiments: they are allowed on the machine that ships, and take the time they say


def made(name: str) -> Plan:
    spec = preset(name).spec
    return plan(spec, MA2000, start_angles(spec, MA2000))


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_allowed_on_the_ma2000_and_all_but_the_ramp_end_where_they_began(name: str) -> None:
    plan = made(name)
    assert check_plan(plan, MA2000, MA2000.limits) == []
    assert bool((plan.postures[-1] == plan.postures[0]).all()) == (name != "ramp")


@pytest.mark.parametrize("kind", [Ramp, Step, Staircase, SlowRamp, Sine, Multisine, Cubic])
def test_what_is_moved_when_nothing_is_said_of_it_is_allowed_on_the_ma2000(kind: Callable[[], Trajectory]) -> None:
    spec = ExperimentSpec(trajectory=kind(), joints=(1, 2, 3))
    assert check_plan(plan(spec, MA2000, start_angles(spec, MA2000)), MA2000, MA2000.limits) == []


def test_presets_are_what_their_names_say() -> None:
    assert made("diagnostic").duration == pytest.approx(55, abs=2.5)
    assert preset("ramp").spec == ExperimentSpec(name="ramp")
    speeds = np.diff(made("diagnostic-a").angles, axis=0) != 0
    assert speeds.any(axis=0)[:3].all()
    assert speeds.sum(axis=1).max() == 1
    speeds = np.abs(np.diff(made("diagnostic-b").angles, axis=0)) / 0.02
    assert math.degrees(speeds.max()) == pytest.approx(5)
    counts = MA2000.calibration(1).rad_per_count
    plan = made("diagnostic-d")
    steps = np.abs(np.diff(plan.angles, axis=0)[plan.jumps[1:]]).max(axis=0)[:3] / counts
    assert (steps * 2 > 127).all()
    with pytest.raises(SpecError, match=r"preset 'dance': .* ramp, diagnostic, diagnostic-a"):
        preset("dance")


def test_pseudo_random_steps_are_fast_and_differ_from_joint_to_joint() -> None:
    motion = made("pseudo-random").angles[25:-50, :3] - made("pseudo-random").angles[0, :3]
    signs = np.sign(motion)
    assert np.abs(np.corrcoef(signs.T) - np.eye(3)).max() < 0.1
    changes = np.flatnonzero(np.diff(signs[:, 0]) != 0)
    assert np.diff(changes).min() == 4, "80 ms of 20 ms each"
    assert made("pseudo-random").duration == pytest.approx(22, abs=0.5)
