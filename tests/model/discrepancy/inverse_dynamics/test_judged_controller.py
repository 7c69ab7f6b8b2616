"""Wrong gains and lost set points of controllers that integrate, beside a balance of torques.

The controllers and the joints that they move are written out here: nothing of `model` made these records.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from daq.contracts.machine import Machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.discrepancy.controller.evidence import JudgedController, judge_controller
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.workflow import diagnose
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES
from model.machine_model.model import base_model
from tests.model.discrepancy.inverse_dynamics import rigs
from tests.model.discrepancy.inverse_dynamics.rigs import quantity
from tests.model.imported import imported

PERIOD, SUBSTEPS = 0.01, 10
"""Of control, s, and integrations within it."""
RESOLUTION = 0.05
"""Of the force, N."""
MASS, COULOMB, VISCOUS = 12.0, 6.0, 25.0
"""Of the sliding axis: kg, N, N·s/m. Its machine file states all three."""
GAINS = {
    "pid": {"gains": ((4000.0, 6000.0, 500.0),)},
    "cascade": {"gains": ((8.0, 0.0, 0.0),), "velocity_gains": ((500.0, 3000.0, 0.0),)},
}
BOTH = {"wrong_gain", "lost_set_points"}


def machine(law: str) -> Machine:
    """The sliding axis with its controller."""
    stated = rigs.slide_machine().model_dump()
    stated["controller"] = {
        "kind": "pid",
        "period": quantity(PERIOD, "s"),
        "delay": quantity(0.0, "s"),
        "drive_resolution": quantity(RESOLUTION, "N"),
        **GAINS[law],
    }
    joint = stated["joints"][0]
    joint["friction"] = {
        "coulomb": quantity(COULOMB, "N", low=0.0, deviation=0.6),
        "viscous": quantity(VISCOUS, "N·s/m", low=0.0, deviation=2.5),
    }
    joint["sensor"] = {"bits": 18, "range": quantity(0.8, "m"), "at_zero": quantity(-0.4, "m")}
    return Machine.model_validate(stated)


@dataclass
class Law:
    """P, I and D of a position's error; in a cascade a speed's set point comes of them. factor: of the output. limit:
    of the force, N, at which the sums go on."""

    name: str
    factor: float
    limit: float = np.inf
    total: float = 0.0
    speed_total: float = 0.0
    last_error: float | None = None
    last_position: float | None = None

    def force(self, wanted: float, read: float) -> float:
        error = wanted - read
        if self.name == "pid":
            ((p, i, d),) = GAINS["pid"]["gains"]
            self.total += error * PERIOD
            change = 0.0 if self.last_error is None else (error - self.last_error) / PERIOD
            out = p * error + i * self.total + d * change
        else:
            ((outer, _, _),), ((p, i, _),) = GAINS["cascade"]["gains"], GAINS["cascade"]["velocity_gains"]
            speed = 0.0 if self.last_position is None else (read - self.last_position) / PERIOD
            short = outer * error - speed
            self.speed_total += short * PERIOD
            out = p * short + i * self.speed_total
        self.last_error, self.last_position = error, read
        out = float(np.clip(self.factor * out, -self.limit, self.limit))
        return float(RESOLUTION * np.round(out / RESOLUTION))


def asked(seed: int, count: int) -> Floats:
    """Set points (k,), m: sines that begin at rest."""
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(count)
    rates = np.array([0.2, 0.45, 0.9])
    waves = np.sin(2 * np.pi * rates * time[:, None] + rng.uniform(0, 6.28, 3)) @ np.array([0.12, 0.06, 0.03])
    return np.asarray((waves - waves[0]) * np.clip(time / 0.5, 0.0, 1.0))


def recorded(
    law: str, seed: int = 1, factor: float = 1.0, lost: float = 0.0, begun: int = 0, limit: float = np.inf
) -> Trace:
    """A record of 14 s. lost: share of the set points that do not arrive. begun: periods that the controller has
    worked before the record begins, so that its sums are not empty."""
    count = 1400
    sent = asked(seed, count + begun)
    rng = np.random.default_rng(seed + 50)
    controller, q, v, used = Law(law, factor, limit), 0.0, 0.0, 0.0
    position, drive = np.empty(len(sent)), np.empty(len(sent))
    count_size = 0.8 / 2**18
    for k in range(len(sent)):
        used = used if k > 0 and rng.random() < lost else sent[k]
        position[k] = count_size * np.round(q / count_size + 0.3 * rng.standard_normal())
        drive[k] = controller.force(used, position[k])
        for _ in range(SUBSTEPS):
            rub = COULOMB * np.tanh(v / 1e-3) + VISCOUS * v
            v += PERIOD / SUBSTEPS * (drive[k] - rub) / MASS
            q += PERIOD / SUBSTEPS * v
    record = imported(f"{law}{seed}", period=PERIOD, drive_unit="N")
    shown = slice(begun, None)
    return Trace(
        record,
        (1,),
        np.asarray(PERIOD * np.arange(count), dtype=np.float64),
        position[shown, None],
        set_point=sent[shown, None],
        drive=drive[shown, None],
    )


def judged(law: str, **hidden: Any) -> JudgedController:
    return judge_controller(base_model(machine(law)), [recorded(law, **hidden)])


@pytest.mark.parametrize("begun", [0, 300])
@pytest.mark.parametrize("law", GAINS)
def test_a_sound_controller_gives_no_finding_and_excludes_its_effects(law: str, begun: int) -> None:
    found = judged(law, begun=begun)
    assert found.findings == ()
    assert set(found.settled) == BOTH


@pytest.mark.parametrize("begun", [0, 300])
@pytest.mark.parametrize("factor", [0.8, 1.05, 1.3])
@pytest.mark.parametrize("law", GAINS)
def test_a_wrong_gain_is_measured(law: str, factor: float, begun: int) -> None:
    (finding,) = judged(law, factor=factor, begun=begun).findings
    assert (finding.effect, finding.joint) == ("wrong_gain", 1)
    assert finding.value == pytest.approx(factor - 1, abs=0.01)


@pytest.mark.parametrize("begun", [0, 300])
@pytest.mark.parametrize("lost", [0.04, 0.2])
@pytest.mark.parametrize("law", GAINS)
def test_lost_set_points_are_counted(law: str, lost: float, begun: int) -> None:
    (finding,) = judged(law, lost=lost, begun=begun).findings
    assert (finding.effect, finding.joint) == ("lost_set_points", 1)
    assert finding.value == pytest.approx(lost, abs=0.02 + 0.1 * lost)


def test_the_drive_of_another_law_proves_and_excludes_nothing() -> None:
    found = judge_controller(base_model(machine("pid")), [recorded("cascade")])
    assert found.findings == ()
    assert found.settled == ()


def test_without_a_controller_nothing_is_judged() -> None:
    found = judge_controller(base_model(rigs.slide_machine()), [rigs.slide_trace(1, {}, duration=4.0)])
    assert (found.findings, found.settled) == ((), ())


FEW = DiagnosisOptions(effects=("viscous_friction", "spring_torque"), most_steps=2)


@pytest.mark.parametrize("law", GAINS)
def test_a_diagnosis_in_torques_says_what_the_controllers_numbers_prove(law: str) -> None:
    """The arm is sound: the wrong gain alone is named, stands in the model, and has cost no fit."""
    model = base_model(machine(law))
    found = diagnose(model, [recorded(law, 1, factor=1.3)], [recorded(law, 2, factor=1.3)], FEW)
    assert found.method == "inverse-dynamics"
    assert found.verdict == "named", found.summary
    (step,) = found.steps
    assert (step.effect, step.joints, step.adopted) == ("wrong_gain", (1,), True)
    assert step.proof is not None
    assert found.model_after.parameter("joint1.wrong_gain.relative").value == pytest.approx(0.3, abs=0.01)


def test_a_diagnosis_in_torques_of_a_sound_controller_names_nothing() -> None:
    found = diagnose(base_model(machine("pid")), [recorded("pid", 1)], [recorded("pid", 2)], FEW)
    assert (found.method, found.verdict, found.steps) == ("inverse-dynamics", "nothing-significant", ())
    (note,) = (n for n in found.notes_data if n.kind == "not-looked-for")
    assert set(note.values["effects"]) == set(NOT_IN_TORQUES) - BOTH


@pytest.mark.parametrize("share", [0.9, 0.6])
@pytest.mark.parametrize("law", GAINS)
def test_a_limit_that_the_file_does_not_state_loses_no_set_points(law: str, share: float) -> None:
    """A drive in steps comes to its limit where the motion is fastest, step by step, as to the top of a motion."""
    drive = recorded(law).drive
    limit = RESOLUTION * float(np.round(share * np.abs(drive).max() / RESOLUTION))
    limited = recorded(law, limit=limit)
    assert (np.abs(limited.drive) == limit).sum() > 2
    assert judged(law, limit=limit).findings == ()


def stated(law: str, **controller: Any) -> Machine:
    """The machine whose file states more of its controller."""
    file = machine(law).model_dump()
    file["controller"].update(controller)
    return Machine.model_validate(file)


@pytest.mark.parametrize("step", [2e-5, 1e-3])
@pytest.mark.parametrize("law", GAINS)
def test_set_points_that_are_rounded_as_the_file_says_are_not_lost(
    law: str, step: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = asked(1, 1400)
    monkeypatch.setitem(globals(), "asked", lambda *_: step * np.floor(sent / step + 0.5))
    trace = replace(recorded(law), set_point=sent[:, None])
    known = base_model(stated(law, set_point_resolution=quantity(step, "m")))
    assert judge_controller(known, [trace]).findings == ()


@pytest.mark.parametrize("law", GAINS)
def test_a_gain_within_its_stated_deviation_is_not_wrong(law: str) -> None:
    known = base_model(stated(law, gain_error=quantity(0.0, "1", deviation=0.05)))
    assert judge_controller(known, [recorded(law, factor=1.04)]).findings == ()
    assert len(judge_controller(known, [recorded(law, factor=1.4)]).findings) == 1


@pytest.mark.parametrize("law", GAINS)
def test_a_gain_beyond_the_bounds_of_its_effect_is_told_and_stays_out_of_the_model(law: str) -> None:
    model = base_model(machine(law))
    found = judged(law, factor=0.04)
    assert [finding.value for finding in found.findings] == [pytest.approx(-0.96, abs=0.01)]
    assert found.with_findings(model) == model
