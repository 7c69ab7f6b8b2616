"""Where torques are missing most."""

from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.progress import Never, silent
from model.discrepancy.explanation.answer_words import what_is_left
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.discrepancy.inverse_dynamics.fitting import TorqueCase
from model.discrepancy.inverse_dynamics.localisation import locate
from model.discrepancy.inverse_dynamics.workflow import TorqueWorkflow
from model.discrepancy.options import TorqueOptions
from model.inverse_dynamics.recorded_motion import recorded_motions
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.inverse_dynamics.searches import sliding


@pytest.fixture(scope="module")
def rubbing() -> TorqueWorkflow:
    return sliding({"coulomb": 8.0}, TorqueOptions(effects=("coulomb_friction",)))


def test_friction_at_a_place_is_seen_where_it_is_and_is_unknown() -> None:
    """Forwards it pushes back, backwards it pushes forwards: its mean over both directions is nothing."""
    traces = [rigs.slide_trace(seed, {"tight": 3.0}, duration=8.0) for seed in (1, 2)]
    found = diagnose_torques(
        base_model(rigs.slide_machine()), traces[:1], traces[1:], TorqueOptions(effects=("spring_torque",))
    )
    assert found.verdict == "unknown-effect", found.summary
    (shape,) = found.remaining
    assert (shape.against, shape.against_motion) == ("position", True)
    assert shape.explained > 0.4
    place = max(zip(shape.centres, shape.torque, strict=True), key=lambda b: b[1] or 0.0)
    assert place[0] == pytest.approx(rigs.SLIDE["tight_at"], abs=0.03)
    assert place[1] is not None
    assert place[1] > 0.5
    assert what_is_left(found.remaining).startswith("friction at joint 1 of ")


def test_the_joint_of_the_largest_residual_is_named(rubbing: TorqueWorkflow) -> None:
    where = locate(rubbing.found.now, rubbing.case)
    assert where.worst is not None
    assert (where.joint, where.worst.joint, where.largest) == (1, 1, None)
    (sizes,) = (np.sqrt(rubbing.case.stretches.mean_squares(rubbing.found.now.residual)),)
    assert where.worst.rms == pytest.approx(sizes[0])
    assert where.worst.ratio == pytest.approx(sizes[0] / rubbing.case.noise[0])


def test_the_joint_of_the_largest_torque_is_told_beside_the_one_farthest_above_its_noise() -> None:
    """Of six joints, the last has three hundred times its noise and the second the largest torque."""
    model = base_model(rigs.six_machine())
    traces = [rigs.six_trace(1, {}, duration=6.0)]
    records = recorded_motions(traces, model.machine, 3.0)
    case = TorqueCase(records, (), np.array([0.1, 0.1, 0.1, 0.1, 0.1, 1e-3]), TorqueOptions())
    flow = TorqueWorkflow(model, case, silent, Never())
    residual = [np.tile([0.1, 9.0, 0.1, 0.1, 0.1, 0.3], (len(r), 1)) for r in flow.found.now.residual]
    where = locate(replace(flow.found.now, residual=residual), case)
    assert where.worst is not None
    assert where.largest is not None
    assert (where.joint, where.worst.joint, where.largest.joint) == (6, 6, 2)
    assert where.worst.ratio == pytest.approx(300.0)
    assert where.largest.rms == pytest.approx(9.0)
