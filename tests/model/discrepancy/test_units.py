"""No answer depends on the unit of the recorded drive: the same names, sizes and margins in V, N, counts or mA."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.traces.csv_table import import_csv
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.engine.fitting import evaluate
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.workflow import diagnose
from model.machine_model.model import base_model
from tests.model.discrepancy import outside_arm
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.inverse_dynamics.test_example import ROOT, written
from tests.model.discrepancy.readings.cases import case_of, probes
from tests.model.discrepancy.units import in_unit, recorded

Rig = Callable[[Path], tuple[Machine, Sequence[Trace]]]
FACTORS = (1e3, 127 / 24)
"""Of V as mV, and of V as counts of a converter whose 127 counts are 24 V."""
IN_DRIVE = {"V", "H"}
"""Units of parameters that are counted in the drive's."""


def _example(name: str) -> Rig:
    def made(folder: Path) -> tuple[Machine, Sequence[Trace]]:
        machine = load_machine(str(ROOT / "examples" / f"{name}.toml"))
        return machine, [import_csv(path) for path in written(folder, f"{name}_rig")[:2]]

    return made


def _outside(**hidden: tuple[int, float]) -> Rig:
    def made(_folder: Path) -> tuple[Machine, Sequence[Trace]]:
        arm = outside_arm.drawn(107)
        for name, (joint, value) in hidden.items():
            arm = arm.changed(name, joint, value)
        return outside_arm.machine(), [outside_arm.record(arm, seed) for seed in (1071, 1072)]

    return made


RIGS: dict[str, Rig] = {
    "linear_axis": _example("linear_axis"),
    "motor_bench": _example("motor_bench"),
    "single_axis": _example("single_axis"),
    "slide": lambda _: (rigs.slide_machine(), [rigs.slide_trace(s, {"coulomb": 6.0}) for s in (1, 2)]),
    "bench": lambda _: (rigs.bench_machine(), [rigs.bench_trace(s, {"dead_zone": 0.8}) for s in (1, 2)]),
    "geared": lambda _: (rigs.geared_machine(), [rigs.geared_trace(s, {"gap": 0.01}) for s in (1, 2)]),
    "outside": _outside(dead_zone=(2, 1.2)),
}
"""Every rig of the examples and the tests that has no board. The board's drive is counts of its own."""


def answered(rig: Rig, folder: Path, factor: float, options: DiagnosisOptions | None = None) -> Diagnosis:
    machine, traces = rig(folder)
    first, *held = [recorded(trace, factor) for trace in traces]
    return diagnose(base_model(in_unit(machine, factor)), [first], held, options or DiagnosisOptions())


def assert_same(usual: Diagnosis, other: Diagnosis, factor: float, exact: float) -> None:
    assert other.verdict == usual.verdict
    assert [(s.effect, s.joints, s.adopted) for s in other.steps] == [
        (s.effect, s.joints, s.adopted) for s in usual.steps
    ]
    for step, same in zip(usual.steps, other.steps, strict=True):
        assert same.evidence == pytest.approx(step.evidence, rel=exact, abs=0.1)
        assert same.margin == pytest.approx(step.margin, rel=exact, abs=0.1)
        assert [c.effect for c in same.group] == [c.effect for c in step.group]
        for name, value in step.parameters.items():
            scale = factor if value.unit in IN_DRIVE else 1.0
            # a search ends within a small share of a deviation, at which one depends on the last bit
            end = 0.0 if value.low is None or value.high is None else 0.15 * (value.high - value.low) / 2.0
            near = pytest.approx(value.value, rel=exact, abs=max(end, 1e-9))
            assert same.parameters[name].value / scale == near


@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("factor", FACTORS)
def test_an_answer_is_the_same_in_every_unit_of_the_drive(name: str, factor: float, tmp_path: Path) -> None:
    usual = answered(RIGS[name], tmp_path, 1.0)
    assert_same(usual, answered(RIGS[name], tmp_path, factor, None), factor, 1e-3)


@pytest.mark.parametrize("name", ["bench", pytest.param("slide", marks=pytest.mark.slow)])
def test_a_short_search_is_the_same_in_every_unit_of_the_drive(name: str, tmp_path: Path) -> None:
    make = {"bench": (rigs.bench_machine, rigs.bench_trace), "slide": (rigs.slide_machine, rigs.slide_trace)}[name]
    few = DiagnosisOptions(effects=("coulomb_friction", "dead_zone"), most_steps=1)

    def rig(_folder: Path) -> tuple[Machine, Sequence[Trace]]:
        return make[0](), [make[1](s, {"coulomb": 0.02 if name == "bench" else 6.0}, duration=5.0) for s in (1, 2)]

    usual = answered(rig, tmp_path, 1.0, few)
    assert any(s.adopted for s in usual.steps)
    for factor in FACTORS[:1]:
        assert_same(usual, answered(rig, tmp_path, factor, few), factor, 1e-3)


@pytest.mark.parametrize("name", ["single_axis", pytest.param("outside", marks=pytest.mark.slow)])
def test_what_probes_of_a_closed_loop_promise_is_the_same_in_every_unit(name: str, tmp_path: Path) -> None:
    machine, (trace, *_) = RIGS[name](tmp_path)
    promised = []
    for factor in (1.0, *FACTORS):
        known = base_model(in_unit(machine, factor))
        kinds = ("dead_zone", "coulomb_friction", "resistance_drift", "spring_torque")
        case = case_of(known, [recorded(trace, factor)], effects=kinds)
        unknowns = case.unknowns(case.given, {})
        given = evaluate(case.compared, unknowns, {u.name: u.start for u in unknowns}, np.ones(len(case.noise)))
        promised.append([p.gain for p in probes(case, given)])
    for other in promised[1:]:
        assert np.array(other) == pytest.approx(np.array(promised[0]), rel=1e-3, abs=1e-3)
    assert max(promised[0]) > 10
