"""The diagnosis of a commissioning asks for an experiment, so it is made by the method that proposes one."""

from types import SimpleNamespace
from typing import Any

import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from extras.commissioning.command import by_command
from model.discrepancy import workflow
from model.discrepancy.options import DiagnosisOptions
from model.machine_model.model import base_model
from tests.model.inverse_dynamics.test_fit_torques import EXAMPLES, swinging


@pytest.mark.parametrize(("machine", "method"), [("single_axis.toml", "output-error"), ("ma2000", None)])
def test_the_loop_of_a_sampled_controller_is_simulated(
    machine: str, method: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[DiagnosisOptions] = []

    def diagnose(*given: Any, **_: Any) -> None:
        asked.append(given[3])
        raise SpecError("seen")

    monkeypatch.setattr(workflow, "diagnose", diagnose)
    begin = base_model(load_machine(str(EXAMPLES / machine) if machine.endswith(".toml") else machine))
    bench: Any = SimpleNamespace(operator=SimpleNamespace(show=lambda _line: None))
    with pytest.raises(SpecError, match="seen"):
        by_command._diagnosed(bench, begin, swinging(1))
    assert asked == [DiagnosisOptions(method=method)]
