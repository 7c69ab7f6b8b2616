"""The bench of real machines: its entries fit together, records are imported, and marks say what they promise."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.real_machines.__main__ import rows, summary, table
from benchmarks.real_machines.judge import judge
from benchmarks.real_machines.records import (
    read_columns,
    write_machine,
    write_record,
)
from benchmarks.real_machines.reference import reference
from benchmarks.real_machines.rigs import HERE, Number, Question, Record, load_rigs
from daq.contracts.machine import load_machine
from ma2000 import read_trace

RIGS = {rig.name: rig for rig in (*load_rigs(), *load_rigs(HERE / "reporting.toml"))}


@pytest.mark.parametrize("rig", RIGS.values(), ids=lambda rig: rig.name)
def test_every_entry_fits_its_machine_file_and_its_alteration_is_one(rig: Any, tmp_path: Path) -> None:
    machine = load_machine(str(rig.machine))
    assert len(machine.joints) == rig.joints
    altered = rig.alteration
    changes = bool(altered.set or altered.remove)
    assert changes != bool(altered.add)
    written = write_machine(rig.machine, altered.set, altered.remove, tmp_path / "m.toml")
    assert (load_machine(str(written)) != machine) == changes


def _pendulum(folder: Path, load: float, seed: int) -> None:
    """A servo's log as its lab would write it: a mass of 0.49 kg at 0.1 m, without friction, 6 s at 200 Hz."""
    generator = np.random.default_rng(seed)
    time = np.arange(1200) / 200
    phase = generator.uniform(0, 6.28, 3)
    q, v, a = np.zeros((3, 1200))
    for k in (1, 2, 3):
        size, rate = 0.5 / k, 2 * np.pi * (0.3 + 0.55 * k)
        q += size * np.sin(rate * time + phase[k - 1])
        v += size * rate * np.cos(rate * time + phase[k - 1])
        a -= size * rate**2 * np.sin(rate * time + phase[k - 1])
    torque = (load * 0.01 + 0.0012) * a + load * 9.80665 * 0.1 * np.sin(q) + 0.04 * v
    counts = np.round(torque * 885 / 7.4 * 3.4 / (0.001227 * 288.35)).astype(int) % 2**16
    entries = [
        {"timestamp": t, "position": p, "speed": s, "load": int(n)}
        for t, p, s, n in zip(time, q, v, counts, strict=True)
    ]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"log_{seed}.json").write_text(json.dumps({"entries": entries}))


@pytest.fixture
def pendulum(tmp_path: Path) -> Any:
    for seed in (1, 2):
        _pendulum(tmp_path / "bam" / "data", load=0.49, seed=seed)
    one, two = (Record((f"log_{k}.json",), 0.5, 5.0) for k in (1, 2))
    return replace(RIGS["xl330"], folder="data", fitted=(one,), held_out=(two,))


def test_a_record_is_renamed_and_imported_by_the_product(pendulum: Any, tmp_path: Path) -> None:
    columns = read_columns(pendulum, pendulum.fitted[0], tmp_path)
    assert list(columns) == ["time", "position_1", "drive_1", "velocity_1"]
    assert columns["time"][0] == 0.5
    assert columns["time"][-1] < 5.0
    assert -7.4 < columns["drive_1"].min() < 0 < columns["drive_1"].max() < 7.4  # counts are signed
    trace = read_trace(write_record(columns, tmp_path / "record.csv", "V"))
    assert np.array_equal(trace.position[:, 0], columns["position_1"])
    assert trace.record.drive_unit == "V"
    linear = reference(
        pendulum.machine, [columns], [read_columns(pendulum, pendulum.held_out[0], tmp_path)], 12.0, offset=True
    )
    assert linear.held_out < 0.02


def _answer(*steps: tuple[str, Sequence[str], Sequence[int], bool], verdict: str = "named", size: float = 0.2) -> Any:
    return {
        "verdict": verdict,
        "steps": [
            {
                "effect": effect,
                "group": [{"effect": each} for each in group],
                "joints": list(joints),
                "adopted": good,
                "refusal": None if good else {"kind": "found-one-way"},
                "parameters": {f"joint{j}.{effect}.torque": {"value": size, "joints": [j]} for j in joints},
            }
            for effect, group, joints, good in steps
        ],
    }


COULOMB = Question("friction", ("coulomb_friction",), (1, 2), "", Number(("coulomb_friction.torque",), 0.1, 0.3, "N·m"))


@pytest.mark.parametrize(
    ("answer", "mark"),
    [
        (_answer(("coulomb_friction", (), (1, 2), True)), "right"),
        (_answer(("coulomb_friction", (), (1,), True), ("coulomb_friction", (), (2,), True)), "right"),
        (_answer(("coulomb_friction", (), (1, 2), True), size=0.4), "half"),
        (_answer(("coulomb_friction", (), (1,), True)), "half"),
        (_answer(("coulomb_friction", (), (1, 2, 3), True)), "half"),
        (_answer(("gear_loss", ("coulomb_friction", "gear_loss"), (1, 2), True)), "half"),
        (_answer(("coulomb_friction", (), (1, 2), False), verdict="unknown-effect"), "honest"),
        (_answer(("spring_torque", (), (1,), True), verdict="unknown-effect"), "wrong"),
        (_answer(("viscous_friction", (), (1,), True)), "wrong"),
        (_answer(verdict="nothing-significant"), "wrong"),
    ],
)
def test_marks(answer: Any, mark: str) -> None:
    assert judge(COULOMB, answer, {"coulomb_friction", "viscous_friction"})[1] == mark


def test_a_rig_that_takes_too_long_or_is_refused_has_no_answer(pendulum: Any, tmp_path: Path) -> None:
    late = rows(pendulum, None, tmp_path, 1.0, None)
    refused = rows(replace(pendulum, drive_unit="A"), pendulum.alteration, tmp_path, 60.0, None)
    assert [each.mark for each in (*late, *refused)] == ["none", "none"]
    assert late[0].answered == "no answer in 1 CPU s"
    assert "error: " in refused[0].answered
    assert "as they are: of 1 questions 0 right" in summary(late)
    assert table([*late, *refused]).count("\n") == 3
