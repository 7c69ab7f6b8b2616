"""Which of the two methods a diagnosis takes, by machine, traces and options."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

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


def noisy() -> Trace:
    """The motion, with accelerations within the noise of its readings."""
    return replace(
        moved(), position=moved().position + np.random.default_rng(3).normal(0.0, 0.3, moved().position.shape)
    )


def short() -> Trace:
    """Too few samples for torques, which a simulation can use: it must not be refused."""
    given, few = moved(), slice(0, 30)
    signals = ("time", "position", "set_point", "drive")
    return replace(given, **{name: getattr(given, name)[few] for name in signals})


def of_the_board() -> Trace:
    return imagined.trace(imagined.arm(), seconds=3.0)


def without(name: str) -> Callable[[], Trace]:
    """The motion without a signal."""
    return lambda: replace(moved(), **{name: None})


TORQUES, LOOP = "inverse-dynamics", "output-error"
BOARD = imagined.arm()


def chosen(model: Model, *traces: Callable[[], Trace], designs: bool = False, **options: object) -> str:
    given = [trace() for trace in traces]
    return choose_method(model, given, DiagnosisOptions.model_validate(options), designs=designs)


@pytest.mark.parametrize(
    ("model", "traces", "options", "method"),
    [
        pytest.param(ARM, [moved], {}, TORQUES, id="the drive of a sampled controller was recorded"),
        pytest.param(ARM, [moved], {"effects": ("coulomb_friction", "dead_zone")}, TORQUES, id="effects in torques"),
        pytest.param(WITHOUT_CONTROLLER, [slid], {}, TORQUES, id="no controller is described"),
        pytest.param(ARM, [moved, without("set_point")], {}, TORQUES, id="one trace has no set points"),
        pytest.param(ARM, [moved], {"effects": ("stiction",)}, LOOP, id="torques do not show it"),
        pytest.param(ARM, [moved], {"effects": ("coulomb_friction", "lost_set_points")}, LOOP, id="nor one of two"),
        pytest.param(ARM, [moved], {"designs": True}, LOOP, id="an experiment is to be designed"),
        pytest.param(BOARD, [of_the_board], {}, LOOP, id="the board's drive"),
        pytest.param(ARM, [moved, without("drive")], {}, LOOP, id="one trace has no drive"),
        pytest.param(ARM, [noisy], {}, LOOP, id="accelerations within noise"),
        pytest.param(ARM, [short], {}, LOOP, id="too short for torques"),
        pytest.param(ARM, [moved], {"method": LOOP}, LOOP, id="the simulation is asked for"),
        pytest.param(BOARD, [of_the_board], {"method": TORQUES}, TORQUES, id="torques are asked for"),
        pytest.param(ARM, [moved], {"method": TORQUES, "designs": True}, TORQUES, id="beside an experiment"),
    ],
)
def test_the_method_is_the_one_that_can_show_what_is_looked_for(
    model: Model, traces: list[Callable[[], Trace]], options: dict[str, Any], method: str
) -> None:
    assert chosen(model, *traces, **options) == method


def test_a_simulation_without_a_controller_or_set_points_is_refused() -> None:
    for model, trace in ((WITHOUT_CONTROLLER, slid), (ARM, without("set_point"))):
        with pytest.raises(SpecError, match="method output-error: simulates the controller, so it needs a machine"):
            chosen(model, trace, method=LOOP)


def test_a_balance_of_torques_without_drives_is_refused() -> None:
    with pytest.raises(TraceError, match="has no recorded drive"):
        diagnose(ARM, [replace(moved(), drive=None)], options=DiagnosisOptions(method="inverse-dynamics"))


@pytest.mark.parametrize("method", ["output-error", "inverse-dynamics"])
@pytest.mark.timeout(300)
def test_the_answer_names_the_method_that_was_asked_for(method: str) -> None:
    options = DiagnosisOptions.model_validate({"method": method, "effects": ("viscous_friction",), "most_steps": 1})
    assert diagnose(ARM, [moved()], options=options).method == method
