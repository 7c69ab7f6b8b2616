"""Numbers in reports: the units of the joints that they are about, and their decimals."""

from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from daq.contracts.machine import Machine, load_machine
from daq_cli.commands.compare import _print_result
from daq_cli.commands.validate import _print_in_time
from daq_cli.models.gap_text import gap_lines
from model.blocks import Table
from model.comparison.agreement import JointAgreement, ModelAgreement, TraceAgreement, pooled
from model.comparison.compare import Comparison
from model.discrepancy.diagnosis import Gap, GapStage
from model.reports.comparison_report import comparison_report
from model.reports.numbers import column, estimate, whole
from model.reports.validation_report import validation_report
from model.units import joint_unit, squared, with_unit
from model.validation.criterion import Fidelity, ParameterDistortion
from model.validation.variation import JointResidual, TimeDomain, Variation

AXIS = Path(__file__).parents[3] / "examples" / "linear_axis.toml"


@pytest.fixture
def axis() -> Machine:
    """A machine with one joint, which slides."""
    return load_machine(str(AXIS))


@pytest.fixture
def labels(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What stands at the axes of figures that are drawn from now on, without the seconds that an SVG costs."""
    found: list[str] = []

    def drawn(draw: Callable[[Figure], None], *_: float) -> str:
        figure = Figure()
        draw(figure)
        for axes in figure.axes:
            found.extend(
                [
                    axes.get_title(),
                    axes.get_xlabel(),
                    axes.get_ylabel(),
                    *(t.get_text() for t in axes.get_yticklabels()),
                ]
            )
        return "<svg></svg>"

    for module in ("validation_report", "motion"):
        monkeypatch.setattr(f"model.reports.{module}.drawn", drawn)
    return found


def agreement(*units: str) -> ModelAgreement:
    """A model on a trace of joints of these units."""
    joints = tuple(
        JointAgreement(joint=j, unit=unit, rmse=0.1, largest=0.2, floor=0.01, count=None, share=None)
        for j, unit in enumerate(units, start=1)
    )
    traces = (TraceAgreement(trace="first", held_out=None, samples=10, joints=joints),)
    return ModelAgreement(label="a", model="abc", effects=(), traces=traces, in_sample=pooled(traces), held_out=None)


def test_the_unit_of_a_joint_is_that_of_its_kind(axis: Machine) -> None:
    assert joint_unit(axis, 1) == "m"
    assert joint_unit(load_machine("ma2000"), 1) == "rad"
    assert squared(["rad", "rad"]) == "rad²"
    assert squared(["m/s"]) == "(m/s)²"
    assert squared(["rad", "m", "rad"]) == "rad² + m²"
    assert with_unit("3", "°") == "3°"
    assert with_unit("3", "mm/s") == "3 mm/s"


@pytest.mark.parametrize(("units", "said"), [(("m",), "0.01 m²"), (("rad", "m"), "0.02 rad² + m²")])
def test_a_comparison_is_in_the_squares_of_its_joints_units(
    capsys: pytest.CaptureFixture[str], units: tuple[str, ...], said: str
) -> None:
    model = agreement(*units)
    _print_result([model], (), as_json=False)
    assert f"in sample {said}\n" in capsys.readouterr().out
    report = comparison_report(Comparison((model,), ()))
    assert f"mean squared error {said} summed" in report.answer
    table = report.sections[0].blocks[1]
    assert isinstance(table, Table)
    assert squared(units) in table.caption


def test_a_validation_of_a_sliding_joint_is_in_metres(
    axis: Machine, labels: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    mass = ParameterDistortion(
        name="link1.mass",
        unit="kg",
        value=1.0,
        change_down=None,
        change_up=None,
        required=None,
        expected=0.1,
        basis="stated",
        contribution=0.0,
    )
    fidelity = Fidelity(
        model="abc",
        traces=("first",),
        outputs=(1,),
        convention="source",
        damping_ratio=0.5,
        error=0.02,
        error_by_joint=(0.02,),
        parameters=(mass,),
        sum_of_contributions=0.0,
    )
    residual = JointResidual(joint=1, values=(0.1, 0.2), noise=0.01, rms=0.15, against=())
    variation = Variation(
        name="link1.mass",
        unit="kg",
        value=1.0,
        values=(0.0, 0.1),
        noise=(0.1, 0.1),
        deviation=0.1,
        expected=0.1,
        mean=0.0,
        significant=0.0,
        alone_constant=0.0,
        alone_varying=0.0,
        against=(),
    )
    in_time = TimeDomain(
        model="abc",
        trace="first",
        convention="source",
        smoothing=0.02,
        time=(0.0, 1.0),
        joints=(residual,),
        parameters=(variation,),
    )
    report = validation_report("axis", (fidelity, fidelity), [in_time], axis)
    assert dict(report.facts)["squared error"].startswith("0.02 m² (")
    assert "measured − expected / m/s²" in labels
    _print_in_time(in_time, axis)
    assert "rms 0.15 m/s², 15 times its noise (0.01 m/s²)" in capsys.readouterr().out


def test_the_gap_of_joints_that_turn_and_slide_is_shown_in_their_own_units() -> None:
    stages = (
        GapStage(kind="given", name="model as given", fitted=(0.2, 0.2), held_out=(0.3, None)),
        GapStage(kind="fitted", name="its numbers fitted", fitted=(0.1, 0.1), held_out=(0.1, 0.1)),
    )
    gap = Gap(measure="closed-loop", joints=(1, 2), units=("rad", "m"), noise=(0.01, 0.01), stages=stages)
    assert [line.split() for line in gap_lines(gap)[1:]] == [
        ["on", "traces", "fitted", "to"],
        ["model", "as", "given", "11.46", "200.0"],
        ["its", "numbers", "fitted", "5.73", "100.0"],
        ["on", "traces", "held", "out"],
        ["model", "as", "given", "17.19", "–"],
        ["its", "numbers", "fitted", "5.73", "100.0"],
        ["noise", "0.57", "10.0"],
    ]
    assert len({len(line) for line in gap_lines(gap) if not line.startswith("on")}) == 1


# ---- Numbers in a column have the same decimals; an interval has the digits that it knows


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ((0.0478, 0.0289), ["0.0478", "0.0289"]),
        ((5.91215, 0.00818), ["5.9121", "0.0082"]),
        ((2000.0, 310.0), ["2000", "310"]),
        ((0.0, 1.5), ["0.00", "1.50"]),
        ((), []),
    ],
)
def test_a_column_has_the_same_decimals_throughout(values: tuple[float, ...], told: list[str]) -> None:
    assert column(values) == told


def test_an_estimate_has_the_digits_of_its_interval_and_the_minus_of_print() -> None:
    assert estimate(9.0731, 8.672, 9.475, digits=1) == ("9.1", "8.7 to 9.5")
    assert estimate(9.0731, 8.672, 9.475) == ("9.07", "8.67 to 9.47")
    assert estimate(-0.12345, None, None) == ("−0.123", None)
    assert estimate(-0.2, -16.0, 16.0, digits=1) == ("0", "−16 to 16")
    assert [whole(v) for v in (-7.4, -0.2, 0.4, 1714.2)] == ["−7", "0", "0", "1714"]
