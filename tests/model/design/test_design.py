"""Excitation design: what an experiment would add, and the set that adds most, within the limits."""

import threading
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from daq.contracts.errors import SafetyError, SpecError, TraceError
from daq.contracts.experiment import ExperimentSpec, Multisine, Pause
from daq.contracts.progress import CancelledError
from daq.safety.check_plan import check_plan
from daq.trajectories.planner import plan as planned
from daq.trajectories.planner import start_angles
from model.design.information import imagined_trace, information_gain
from model.design.search import DesignOptions, best_set, design
from model.fitting.fit import fit
from model.fitting.options import FitOptions
from model.reports.design_report import PlannedExperiment, design_report
from model.reports.page import write_report
from tests.model.fitting.imagined import arm, machine, trace, traces

NAMES = ("load.mass", "joint2.motor.back_emf_constant", "joint3.load_dependent_friction.arm")
FEW = FitOptions(parameters=NAMES, sensor_bend=False)


def plan(spec: ExperimentSpec) -> NDArray[np.float64]:
    """Set points within the machine's limits."""
    own = planned(spec, machine(), start_angles(spec, machine()))
    for violation in check_plan(own, machine(), machine().limits):
        raise SafetyError(violation.message)
    return own.angles


def multisine(size: float, **fields: object) -> ExperimentSpec:
    return ExperimentSpec.model_validate(
        {"trajectory": Multisine(amplitude=size, duration=6.0, highest=0.8), "hold": 0.5, **fields}
    )


def test_a_larger_motion_gives_more_information_and_standing_still_hardly_any() -> None:
    small, large = (information_gain(arm(), [multisine(s)], plan, options=FEW) for s in (0.05, 0.2))
    assert 0 < small.nats < large.nats
    for little, much in zip(small.parameters, large.parameters, strict=True):
        assert much.after < little.after <= little.before
    with pytest.raises(TraceError, match="no motion"):
        information_gain(arm(), [multisine(0.1, trajectory=Pause(duration=4.0))], plan, options=FEW)


def test_an_experiment_adds_less_to_a_fitted_model_and_as_much_as_its_prediction() -> None:
    known = fit(arm(), traces(arm(), 1, 5.0), FEW.model_copy(update={"replicas": 0, "rounds": 1}))
    fresh = information_gain(arm(), [multisine(0.2)], plan, options=FEW)
    after = information_gain(arm(), [multisine(0.2)], plan, fitted=known)
    assert 0 < after.nats < fresh.nats
    deviations = [p.before / (2 * 1.959964) for p in after.parameters]
    assert deviations == pytest.approx([known.covariance_matrix[k, k] ** 0.5 for k in range(3)], rel=1e-6)
    predicted = information_gain(arm(), [multisine(0.2)], plan, options=FEW)
    imagined = imagined_trace(arm(), multisine(0.2), plan)
    assert imagined.set_point is not None
    found = fit(arm(), [trace(arm(), points=imagined.set_point)], FEW.model_copy(update={"replicas": 4, "rounds": 2}))
    for k, p in enumerate(predicted.parameters):
        width = 2 * 1.959964 * found.covariance_matrix[k, k] ** 0.5
        assert 0.4 < p.after / width < 2.5, p.name


def test_designed_experiments_stay_within_limits_and_beat_the_first_drawn() -> None:
    options = DesignOptions(experiments=2, duration=5.0, candidates=9, seed=3)
    found = design(arm(), plan, options, FEW)
    assert len(found.specs) == 2
    for spec in found.specs:
        plan(spec)
    assert found.nats[0] < found.nats[1]
    assert found.refused < found.considered == 9
    again = design(arm(), plan, options, FEW)
    assert again == found


def test_the_page_shows_every_experiment_and_what_becomes_known(tmp_path: Path) -> None:
    specs = [multisine(0.2, name="wide"), multisine(0.05, name="narrow", gains={2: (3, 0, 0)})]
    gain = information_gain(arm(), specs, plan, options=FEW)
    shown = [PlannedExperiment(s, plan(s)) for s in specs]
    page = write_report(design_report(arm(), shown, gain, "Given."), tmp_path / "design.html").read_text("utf-8")
    for text in (*NAMES, "wide: multisine", "narrow: multisine", "gains joint 2: 3/0/0", "95 % width before"):
        assert text in page
    assert page.count("<svg") == 3
    assert f"{gain.nats:.1f} nats" in page


def test_a_design_can_be_cancelled_or_have_no_allowed_candidate() -> None:
    def refusing(_spec: ExperimentSpec) -> NDArray[np.float64]:
        raise SafetyError("joint 2 leaves its range")

    with pytest.raises(SpecError, match="none of 4 candidates can be carried out; the last: joint 2 leaves its range"):
        design(arm(), refusing, DesignOptions(candidates=4), FEW)
    now = threading.Event()
    now.set()
    with pytest.raises(CancelledError):
        design(arm(), plan, DesignOptions(candidates=4), FEW, cancel=now)


def test_the_best_set_is_found_where_greed_fails_or_there_are_too_few() -> None:
    # One matrix is good at everything but two others together are better: an exchange has to find them
    prior = 0.01 * np.eye(2)
    middling, first, second = np.diag([5.0, 5.0]), np.diag([9.0, 0.5]), np.diag([0.5, 9.0])
    assert sorted(best_set(prior, [middling, first, second], 2)) in ([1, 2], [0, 1], [0, 2])
    pairs = {"mf": (middling, first), "ms": (middling, second), "fs": (first, second)}
    total = {name: np.linalg.det(prior + a + b) for name, (a, b) in pairs.items()}
    chosen = best_set(prior, [middling, first, second], 2)
    value = np.linalg.det(prior + sum([middling, first, second][k] for k in chosen))
    assert value == pytest.approx(max(total.values()))
    assert best_set(np.eye(2), [np.eye(2)], 4) == [0]
