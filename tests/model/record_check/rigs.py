"""The rigs into whose records faults are put: every example's, the tests' own, the mock's, and independent worlds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

import numpy as np

from daq.contracts.machine import Machine, load_machine
from daq.contracts.trace import Trace
from daq.traces.csv_table import import_csv
from daq.trajectories.presets import preset
from tests.model.discrepancy import outside_arm
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.recording import recorded
from tests.model.imported import imported
from trials.rigs.folder import write_rig

ROOT = Path(__file__).parents[3]
Made = Callable[[Path], tuple[Machine, Trace]]


def _program(name: str) -> ModuleType:
    spec = spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def _machine(name: str) -> Machine:
    return load_machine(str(ROOT / "examples" / f"{name}.toml"))


def example(name: str) -> Made:
    """A record that an example's rig writes."""
    return lambda folder: (_machine(name), import_csv(_program(f"{name}_rig").write(folder, seeds=(1,))[0]))


def line_stage(_folder: Path) -> tuple[Machine, Trace]:
    """A record of the stage on a line, made period by period as its controller has them."""
    program = _program("line_stage_rig")
    stage, time = program.Stage(), np.arange(5000) * 1e-3
    stage.state = "R"
    waves = ((0.4, 0.03), (0.9, 0.012), (1.7, 0.005))
    begun = np.maximum(time - 0.3, 0.0)
    goals = [sum(a * np.sin(2 * np.pi * f * begun * (1 + 0.1 * k)) for f, a in waves) for k in range(2)]
    rows = []
    for k in range(len(time)):
        for axis, goal in zip(stage.axes, goals, strict=True):
            axis.goal = round((0.1 + goal[k]) / program.COUNT)
        stage.advance_to(k + 1)
        rows.append([(a.goal * program.COUNT, a.counts * program.COUNT, 24 * a.pwm / program.FULL) for a in stage.axes])
    asked, position, drive = np.moveaxis(np.array(rows), 2, 0)
    record = imported("stage", period=0.001)
    return _machine("line_stage"), Trace(record, (1, 2), time, position, set_point=asked, drive=drive)


def mock(*modifications: str, experiment: str = "ramp") -> Made:
    """A record of the mock, with the columns that a CSV file has."""

    def made(folder: Path) -> tuple[Machine, Trace]:
        machine = load_machine("ma2000")
        (trace,) = recorded([preset(experiment).spec], machine, 7, folder, modifications)
        beside = dict.fromkeys(("error", "power_raw", "tick", "host_time", "status", "taken"))
        return machine, replace(trace, **beside)  # type: ignore[arg-type]

    return made


def world(kind: str, seed: int, case: str | None = None, effect: str | None = None) -> Made:
    """A record of an independent world."""

    def made(folder: Path) -> tuple[Machine, Trace]:
        write_rig(folder, kind, seed, case, effect)
        return load_machine(str(folder / "lab" / "machine.toml")), import_csv(folder / "lab" / "training.csv")

    return made


def _outside(_folder: Path) -> tuple[Machine, Trace]:
    return outside_arm.machine(), outside_arm.record(outside_arm.drawn(107), 1071)


RIGS: dict[str, Made] = {
    "linear_axis": example("linear_axis"),
    "motor_bench": example("motor_bench"),
    "single_axis": example("single_axis"),
    "line_stage": line_stage,
    "slide": lambda _: (rigs.slide_machine(), rigs.slide_trace(1, {}, 12.0)),
    "bench": lambda _: (rigs.bench_machine(), rigs.bench_trace(1, {}, 12.0)),
    "geared": lambda _: (rigs.geared_machine(), rigs.geared_trace(1, {}, 12.0)),
    "outside": _outside,
    "mock": mock(),
    "axis-cascade": world("axis-cascade", 0),
    "planar-torques": world("planar-torques", 0),
}
