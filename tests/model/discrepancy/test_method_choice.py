"""Which of the two methods a diagnosis takes, by machine, traces and options."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.trace import Trace
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.workflow import choose_method, diagnose
from model.machine_model.model import Model, base_model
from tests.model.discrepancy import outside_arm
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.fitting import imagined

ARM = base_model(outside_arm.machine())
"""Its controller is a sampled PD, and its drive is recorded."""
WITHOUT_CONTROLLER = base_model(rigs.slide_machine())


@cache
def moved() -> Trace:
    return outside_arm.record(outside_arm.drawn(1), 11, duration=6.0)


@cache
def slid() -> Trace:
    return rigs.slide_trace(1, {}, duration=4.0)


def chosen(model: Model, trace: Trace, *, designs: bool = False, **options: object) -> str:
    return choose_method(model, [trace], DiagnosisOptions.model_validate(options), designs=designs)


@pytest.mark.slow
def test_torques_are_balanced_where_a_sampled_controllers_drive_was_recorded() -> None:
    assert chosen(ARM, moved()) == "inverse-dynamics"
    assert chosen(ARM, moved(), effects=("coulomb_friction", "dead_zone")) == "inverse-dynamics"


def test_torques_are_balanced_where_no_controller_is_described() -> None:
    assert chosen(WITHOUT_CONTROLLER, slid()) == "inverse-dynamics"


def test_torques_are_balanced_where_one_trace_has_no_set_points() -> None:
    without = replace(moved(), set_point=None)
    assert choose_method(ARM, [moved(), without], DiagnosisOptions(), designs=False) == "inverse-dynamics"


@pytest.mark.parametrize("effects", [("stiction",), ("coulomb_friction", "lost_set_points")])
def test_the_loop_is_simulated_for_effects_that_torques_do_not_show(effects: tuple[str, ...]) -> None:
    assert chosen(ARM, moved(), effects=effects) == "output-error"


def test_the_loop_is_simulated_where_an_experiment_is_to_be_designed() -> None:
    assert chosen(ARM, moved(), designs=True) == "output-error"


def test_the_loop_of_the_board_is_simulated() -> None:
    record = imagined.trace(imagined.arm(), seconds=3.0)
    assert record.drive is not None
    assert chosen(imagined.arm(), record) == "output-error"


def test_the_loop_is_simulated_where_a_drive_was_not_recorded() -> None:
    without = replace(moved(), drive=None)
    assert choose_method(ARM, [moved(), without], DiagnosisOptions(), designs=False) == "output-error"


def test_the_loop_is_simulated_where_accelerations_are_within_the_noise_of_readings() -> None:
    noise = np.random.default_rng(3).normal(0.0, 0.3, moved().position.shape)
    assert chosen(ARM, replace(moved(), position=moved().position + noise)) == "output-error"


def test_the_loop_is_simulated_where_a_record_is_too_short_for_torques() -> None:
    """Where torques have no answer, a record that the simulation can use must not be refused."""
    given = moved()
    assert given.set_point is not None
    assert given.drive is not None
    few = slice(0, 30)
    short = replace(
        given,
        time=given.time[few],
        position=given.position[few],
        set_point=given.set_point[few],
        drive=given.drive[few],
    )
    assert chosen(ARM, short) == "output-error"


def test_a_method_that_is_asked_for_is_taken() -> None:
    assert chosen(ARM, moved(), method="output-error") == "output-error"
    record = imagined.trace(imagined.arm(), seconds=3.0)
    assert chosen(imagined.arm(), record, method="inverse-dynamics") == "inverse-dynamics"
    assert chosen(ARM, moved(), method="inverse-dynamics", designs=True) == "inverse-dynamics"


def test_a_simulation_without_a_controller_or_set_points_is_refused() -> None:
    for model, trace in ((WITHOUT_CONTROLLER, slid()), (ARM, replace(moved(), set_point=None))):
        with pytest.raises(SpecError, match="method output-error: simulates the controller, so it needs a machine"):
            chosen(model, trace, method="output-error")


def test_a_balance_of_torques_without_drives_is_refused() -> None:
    with pytest.raises(TraceError, match="has no recorded drive"):
        diagnose(ARM, [replace(moved(), drive=None)], options=DiagnosisOptions(method="inverse-dynamics"))


@pytest.mark.parametrize("method", ["output-error", "inverse-dynamics"])
@pytest.mark.timeout(300)
def test_the_answer_names_the_method_that_was_asked_for(method: str) -> None:
    options = DiagnosisOptions.model_validate({"method": method, "effects": ("viscous_friction",), "most_steps": 1})
    assert diagnose(ARM, [moved()], options=options).method == method
