"""Every table of results fits 80 columns, and no number or word of it is cut."""

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import daq_cli
from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq_cli.models.gap_text import gap_lines
from model.comparison.agreement import JointAgreement, ModelAgreement
from model.discrepancy.diagnosis import Gap, GapStage, GapWithout
from model.fitting.fitted import FittedParameter
from model.validation.criterion import Fidelity, ParameterDistortion
from model.validation.variation import Correlation, TimeDomain, Variation
from tests.daq.traces.samples import write
from tests.daq_cli.invoke import CommandLine

LONG = "joint2.direction_dependent_friction.coefficient_forwards"


def parameters() -> None:
    from daq_cli.models.parameter_table import print_parameters

    common = {"unit": "N·m·s²/rad²", "reason": "", "before": 0.000123456, "expected": 1.0, "expected_deviation": 0.1}
    known = {"verdict": "known", "value": 12.345678, "deviation": 1e-6, "low": 12.345670, "high": 12.345686}
    unknown = {"verdict": "combination", "value": None, "deviation": None, "low": None, "high": None}
    print_parameters(
        [
            FittedParameter(name=LONG, model_value=12.345678, at_bound="low", **known, **common),
            FittedParameter(name="link2.mass", model_value=0.846, at_bound=None, **unknown, **common),
        ]
    )


def agreement() -> None:
    from daq_cli.models.parameter_table import print_rows
    from model.reports.motion import AGREEMENT, agreement_table

    sizes = {"rmse": 0.2154, "largest": 1.4, "floor": 0.001, "count": 0.0046, "share": 0.01}
    joints = tuple(JointAgreement(joint=j, unit="rad", **sizes) for j in range(1, 7))
    common = {"model": "m", "effects": (), "traces": ()}
    label = "a-model-with-quite-a-long-name-of-its-own.json"
    models = [ModelAgreement(label=label, in_sample=joints, held_out=joints, **common)]
    print_rows(agreement_table(models).only(*AGREEMENT))


def validation() -> None:
    from daq_cli.commands.validate import _print_result

    distortion = ParameterDistortion(
        name=LONG,
        unit="N·m·s²/rad²",
        value=12.345678,
        change_down=0.000123456,
        change_up=0.0001,
        required=None,
        expected=0.0123,
        basis="stated",
        contribution=0.0,
    )
    fidelity = Fidelity(
        model="m",
        traces=("t",),
        outputs=(1,),
        convention="source",
        damping_ratio=0.5,
        error=1.0,
        error_by_joint=(1.0,),
        noise_by_joint=(0.5,),
        parameters=(distortion,),
        sum_of_contributions=0.3,
    )
    told = (Correlation(regressor="magnitude of speed", joint=2, value=0.53, noise=0.01),) * 2
    sizes = {"deviation": 0.1, "expected": 0.2, "mean": 0.0, "significant": 0.5, "alone_constant": 0.1}
    moving = Variation(name=LONG, unit="kg", value=1.0, values=(), noise=(), alone_varying=0.4, against=told, **sizes)
    in_time = TimeDomain(
        model="m", trace="t", convention="source", smoothing=0.05, time=(), joints=(), parameters=(moving,)
    )
    for details in (False, True):
        _print_result(fidelity, fidelity, [in_time], load_machine("ma2000"), as_json=False, details=details)


def gap() -> None:
    joints = tuple(range(1, 7))
    stage = {"fitted": (0.001,) * 6, "held_out": (0.002,) * 6}
    found = Gap(
        measure="closed-loop",
        joints=joints,
        units=("rad",) * 6,
        noise=(1e-4,) * 6,
        stages=(
            GapStage(kind="given", name="model as given", **stage),
            GapStage(kind="effect", name="+ Coulomb friction on joint 2", **stage),
            GapStage(kind="refitted", name="everything refitted", **stage),
        ),
        without=GapWithout(**stage, text=f"The numbers would have had to become {LONG} 0.846 kg."),
    )
    print("\n".join(" " * 9 + line for line in gap_lines(found)))


@pytest.mark.parametrize("show", [parameters, agreement, validation, gap])
def test_a_table_of_results_fits(
    show: Callable[[], None], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    show()
    fits(capsys.readouterr().out)


@pytest.mark.parametrize("words", [("ls", "{}"), ("show", "{}/a.mcap")])
def test_a_table_of_traces_fits(
    daq: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, str]
) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    write(tmp_path / "a.mcap", 50, spec=ExperimentSpec(name="a-ramp-of-the-shoulder-and-the-elbow", joints=(1, 3)))
    shown = daq("traces", *(word.format(tmp_path) for word in words))
    assert shown.code == 0
    fits("\n".join(line for line in shown.out.splitlines() if not line.startswith("file: ")))
    if words[0] == "ls":
        assert "1,3" in shown.out, "the joints that moved, not those that were recorded"


def fits(text: str) -> None:
    lines = text.splitlines()
    assert lines
    assert max(map(len, lines)) <= 80, text
    assert "…" not in text
    assert not re.findall(r"\d\.$", text, re.MULTILINE), "a number goes on in the next line"
    assert not re.findall(r"[\d±]\n\s*(?:kg|mm|m|rad|N·m|V|s)\b", text), "a number stands apart from its unit"
    assert not re.findall(r"/$", text, re.MULTILINE), "a unit goes on in the next line"


def test_every_table_goes_through_the_door_that_makes_it_fit() -> None:
    """Only two files make a console: one for remarks, one that prints tables."""
    folder = Path(daq_cli.__file__).parent
    makes = [file.relative_to(folder).as_posix() for file in folder.rglob("*.py") if "Console(" in file.read_text()]
    assert makes == ["app/context.py"]


def test_a_folder_is_named_once(daq: CommandLine, tmp_path: Path) -> None:
    daq("traces", "ls", tmp_path, "--folder", tmp_path).complains(2, "named already")
    daq("traces", "ls", tmp_path / "none").complains(2, "is no folder")
