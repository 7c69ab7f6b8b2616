"""docs/one-joint-rig.md: the rig's CSV files, its machine file, and what the diagnosis says of them."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from daq.traces.csv_table import import_csv
from daq_cli.models.diagnosis_text import answer_text
from model.discrepancy.workflow import diagnose
from model.machine_model.model import base_model

ROOT = Path(__file__).parents[4]


def written(folder: Path, name: str = "motor_bench_rig") -> list[Path]:
    """The records of a pretended rig."""
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    rig = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(rig)
    return list(rig.write(folder))


def without_numbers(text: str) -> str:
    """An answer's words and layout; its numbers differ in their last digits from one processor to the next."""
    return re.sub(r" +", " ", re.sub(r"-?\d+(\.\d+)?", "#", text))


def test_the_guide_shows_the_example_machine() -> None:
    shown = re.findall(r"```toml\n(.*?)```", (ROOT / "docs" / "one-joint-rig.md").read_text("utf-8"), re.DOTALL)
    assert shown[0] == (ROOT / "examples" / "motor_bench.toml").read_text("utf-8")
    assert len(shown[0].splitlines()) <= 20
    assert shown[1] == (ROOT / "examples" / "linear_axis.toml").read_text("utf-8")


def test_the_example_names_the_friction_that_the_rig_hides(tmp_path: Path) -> None:
    first, second = (import_csv(path) for path in written(tmp_path))
    model = base_model(load_machine(str(ROOT / "examples" / "motor_bench.toml")))
    found = diagnose(model, [first], [second])
    assert found.verdict == "named"
    assert [(s.effect, s.joints) for s in found.steps if s.adopted] == [("coulomb_friction", (1,))]
    value = found.steps[0].parameters["joint1.coulomb_friction.torque"]
    assert value.value == pytest.approx(0.008, rel=0.03)
    before, after = found.steps[0].rmse_holdout[0].before, found.steps[0].rmse_holdout[0].after
    assert after < 0.2 * before
    guide = (ROOT / "docs" / "one-joint-rig.md").read_text("utf-8")
    (sample,) = re.findall(r"```\n(NAMED.*?)```", guide, re.DOTALL)
    assert without_numbers(answer_text(found)).startswith(without_numbers(sample.rstrip())), "as the guide shows it"


def test_a_sliding_axis_names_its_guides_and_its_magnets_and_nothing_else(tmp_path: Path) -> None:
    """It stands for a moment at every reversal, and its drive is held between samples: neither is an effect."""
    first, second = (import_csv(path) for path in written(tmp_path, "linear_axis_rig"))
    model = base_model(load_machine(str(ROOT / "examples" / "linear_axis.toml")))
    found = diagnose(model, [first], [second])
    assert found.verdict == "named"
    assert [s.effect for s in found.steps if s.adopted] == ["coulomb_friction", "torque_ripple"]
    values = {n: v.value for s in found.steps for n, v in s.parameters.items()}
    assert values["joint1.coulomb_friction.torque"] == pytest.approx(8.0, rel=0.01)
    assert values["joint1.torque_ripple.sine"] == pytest.approx(-5.0, rel=0.01)
    assert values["joint1.torque_ripple.cycles"] == pytest.approx(2 * np.pi / 0.032, rel=1e-3)
    assert found.model_after.parameter("link1.mass").value == pytest.approx(6.0, rel=0.01)
    error = found.steps[-1].rmse_holdout[0]
    assert error.after < 0.05 * found.steps[0].rmse_holdout[0].before
    value = found.steps[0].parameters["joint1.coulomb_friction.torque"].value
    assert f"(torque {value:.3g} N)" in found.steps[0].reason, "the reason has the last fit's number too"
