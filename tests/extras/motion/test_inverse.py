"""Set points from a model: the mock follows the motion with them, within the limits, as nearly as the model says."""

from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.experiment import ExperimentSpec, parse_spec
from daq.contracts.experiment import Path as PathOfAngles
from daq.contracts.machine import load_machine
from daq.safety.check_plan import check_plan
from daq.trajectories.planner import plan as plan_of
from daq.trajectories.planner import start_angles
from extras.motion.inverse import feedforward
from model.machine_model.model import base_model
from tests.extras.motion.motions import RAMP, arm, attempts, judged, machine, plan, rms


def computed(asked: ExperimentSpec = RAMP) -> ExperimentSpec:
    return feedforward(arm(), asked, machine(), plan)


@pytest.fixture(scope="module")
def inverted() -> ExperimentSpec:
    """Of the ramp."""
    return computed()


def test_the_mock_follows_a_ramp_with_less_than_a_third_of_the_plain_error(
    inverted: ExperimentSpec, tmp_path: Path
) -> None:
    plain, better = attempts([RAMP, inverted], tmp_path)
    assert rms(better) < rms(plain) / 3
    assert plain.record.spec == RAMP
    spec = better.record.spec
    assert spec is not None
    assert spec.wanted_motion == RAMP
    assert spec.feedforward is not None
    assert (spec.feedforward.asked, spec.feedforward.model) == (RAMP.without_feedforward, arm().identity)
    for joint, error in judged(better).errors.items():
        expected, before = spec.feedforward.expected[joint], spec.feedforward.before[joint]
        assert expected.rms / 2 < error.rms < 2 * expected.rms
        assert before.rms == pytest.approx(judged(plain).errors[joint].rms, rel=0.2)


def test_a_joint_that_is_quick_and_damped_is_inverted_as_well() -> None:
    """Its response needs short steps of integration: with long ones it comes out with the wrong sign."""
    motor = {"rotor_inertia": 5e-7, "back_emf_constant": 0.08, "torque_constant": 0.0123, "resistance": 2.8}
    quick = arm().with_values({f"joint3.motor.{name}": value for name, value in motor.items()} | {"load.mass": 0.3})
    found = feedforward(quick, RAMP, machine(), plan).feedforward
    assert found is not None
    assert found.expected[3].rms < found.before[3].rms / 5


def test_set_points_keep_the_machine_s_limits_and_begin_where_the_arm_stands() -> None:
    fast = parse_spec({"trajectory": {"kind": "ramp", "duration": 0.45}, "hold": 0.5})
    found = computed(fast)
    motion = plan_of(found, machine(), start_angles(found, machine()))
    asked = plan(fast)
    assert not check_plan(motion, machine(), machine().limits)
    assert len(motion) == len(asked)
    assert (motion.angles[0] == asked[0]).all()
    assert not motion.jumps.any()
    unit = np.array([machine().calibration(joint).rad_per_posture_unit for joint in (1, 2, 3)])
    speeds = np.abs(np.diff(motion.postures[:, :3], axis=0)) * np.abs(unit) / motion.period
    assert (speeds.max(axis=0) <= [1.6, 1.2, 1.6]).all()
    assert speeds.max() > 1.0, "the drive should be asked for much where the ramp begins"


def test_joints_that_the_experiment_does_not_move_are_left_where_they_are() -> None:
    only = computed(parse_spec({"trajectory": {"kind": "cubic"}, "joints": [2], "hold": 0.3}))
    assert isinstance(only.trajectory, PathOfAngles)
    assert {len(row) for row in only.trajectory.positions} == {1}
    assert only.feedforward is not None
    assert set(only.feedforward.expected) == {2}


def test_repeats_and_rests_become_part_of_the_path() -> None:
    rests = {"settle": 0.2, "hold": 0.2, "repeats": 2, "gains": {2: [3, 0, 0]}}
    asked = parse_spec({"trajectory": {"kind": "cubic", "amplitude": 0.1, "duration": 0.5}, **rests})
    found = computed(asked)
    assert (found.settle, found.hold, found.repeats) == (0.0, 0.0, 1)
    assert found.gains == {1: (2, 0, 0), 2: (3, 0, 0), 3: (2, 0, 0)}, "set points suit one set of gains"
    assert len(plan(found)) == len(plan(asked))


def test_what_set_points_cannot_be_computed_for_is_refused_in_one_line(inverted: ExperimentSpec) -> None:
    axis = base_model(load_machine(str(Path(__file__).parents[3] / "examples" / "single_axis.toml")))
    with pytest.raises(SpecError, match=r"is of .*, but the experiment is for ma2000"):
        feedforward(axis, RAMP, machine(), plan)
    with pytest.raises(SpecError, match="already computed"):
        computed(inverted)
    wrist, long = (parse_spec({"trajectory": {"kind": "ramp"}, **one}) for one in ({"joints": [4]}, {"hold": 700}))
    with pytest.raises(SpecError, match=r"joints \[4\]: set points are computed only for joints 1, 2, 3"):
        computed(wrist)
    with pytest.raises(SpecError, match="at most 600 s"):
        computed(long)
    controller = machine().controller.model_copy(update={"gains": ((3, 0, 0),) * 6})
    other = machine().model_copy(update={"controller": controller})
    with pytest.raises(SpecError, match="another controller"):
        feedforward(base_model(other), RAMP, machine(), plan)
