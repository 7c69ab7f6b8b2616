"""Identifiability on Jacobians whose blind directions are known."""

from functools import partial

import numpy as np
import pytest

from daq.contracts.service.jobs import ParameterWords
from model.arrays import Floats
from model.fitting.identifiability import judged, undetermined_in_words
from model.fitting.unknowns import Unknown
from model.machine_model.parameter import Kind, Parameter
from model.units import torque_power

RANDOM = partial(np.random.default_rng, 5)


def unknown(name: str, unit: str, value: float, deviation: float | None = None, nuisance: bool = False) -> Unknown:
    parameter = Parameter(name=name, kind=Kind.INERTIA, part="mass", unit=unit, value=value)
    return Unknown(parameter, value, expected=value, deviation=deviation, nuisance=nuisance)


def pendulum_jacobian(values: Floats, noise: float) -> Floats:
    """Whitened Jacobian of θ̈ = (K u − v θ̇ − m g l sin θ)/(m l²) in torque per inertia: only K/m, v/m, l count.

    Unknowns: mass m (kg), length l (m), torque constant K (N·m/A), viscous v (N·m·s/rad).
    """
    m, length, K, v = values
    u, speed, s = RANDOM().normal(size=(3, 400))
    torque, inertia = K * u - v * speed, m * length**2
    by_mass, by_length = -torque / (m * inertia), -2 * torque / (length * inertia) + 9.81 * s / length**2
    return np.stack([by_mass, by_length, u / inertia, -speed / inertia], axis=1) / noise


VALUES = np.array([1.2, 0.3, 0.02, 0.005])
UNKNOWNS = (
    unknown("link1.mass", "kg", 1.2, 0.12),
    unknown("link1.length", "m", 0.3, 0.01),
    unknown("joint1.motor.torque_constant", "N·m/A", 0.02, 0.001),
    unknown("joint1.viscous_friction.coefficient", "N·m·s/rad", 0.005, 0.002),
)


def test_the_scale_of_torque_is_found_named_and_fixed_once_one_torque_is_held() -> None:
    # The scale of torque is found and named
    report = judged(pendulum_jacobian(VALUES, 1e-3), VALUES, UNKNOWNS)
    assert report.torque_scale_free
    assert len(report.undetermined) == 1
    only = report.undetermined[0]
    assert only.torque_scale
    assert only.deviation is None
    assert {m.name: m.change for m in only.members} == {
        "link1.mass": 1.0,
        "joint1.motor.torque_constant": 1.0,
        "joint1.viscous_friction.coefficient": 1.0,
    }
    verdicts = {p.name: p.verdict for p in report.parameters}
    assert verdicts["link1.length"] == "known"
    assert verdicts["link1.mass"] == verdicts["joint1.motor.torque_constant"] == "combination"
    assert "scale of torque" in report.verdict("link1.mass").reason
    assert report.verdict("link1.mass").data_deviation is None
    # The scale is fixed once one torque is held
    held = [0, 1, 3]
    report = judged(pendulum_jacobian(VALUES, 1e-3)[:, held], VALUES[held], [UNKNOWNS[k] for k in held])
    assert not report.torque_scale_free
    assert report.undetermined == ()
    assert report.known == ("link1.mass", "link1.length", "joint1.viscous_friction.coefficient")


def test_a_sum_is_named_as_a_combination() -> None:
    rng = RANDOM()
    column = rng.normal(size=(300, 1))
    J = np.concatenate([column, column, rng.normal(size=(300, 1))], axis=1)
    unknowns = [unknown(n, "V", 2.0, 0.5) for n in ("a", "b", "c")]
    report = judged(J, np.full(3, 2.0), unknowns)
    (only,) = report.undetermined
    assert {m.name for m in only.members} == {"a", "b"}
    assert only.members[0].change == pytest.approx(-only.members[1].change)
    assert [p.verdict for p in report.parameters] == ["combination", "combination", "known"]
    words = {"a": ParameterWords(joint=2, group="joint 2", short="friction", label="J2 friction")}
    assert only.text in ("together a +1 %, b −1 %", "together a −1 %, b +1 %")
    assert undetermined_in_words(report, words) == (only.text.replace("a ", "J2 friction "),)


def test_what_is_expected_or_without_influence_is_not_known() -> None:
    tight = [unknown("a", "m", 1.0, 1e-6)]
    assert judged(np.full((100, 1), 1.0), np.ones(1), tight).known == ()
    rng = RANDOM()
    J = np.concatenate([rng.normal(size=(300, 1)), np.zeros((300, 1)), 1e-3 * rng.normal(size=(300, 1))], axis=1)
    report = judged(J, np.ones(3), [unknown(n, "m", 1.0, 0.3) for n in ("a", "b", "c")])
    assert [p.verdict for p in report.parameters] == ["known", "unknown", "unknown"]
    assert "not change these records at all" in report.verdict("b").reason
    assert "standard deviations of the noise" in report.verdict("c").reason
    assert [c.text for c in report.undetermined] == ["b alone", "c alone"]


def test_a_nuisance_blurs_the_parameter_it_resembles_as_far_as_its_prior_allows() -> None:
    column = RANDOM().normal(size=(400, 1))
    J = np.concatenate([column, column], axis=1)
    wide = [unknown("a", "rad", 1.0, 1.0), unknown("n", "rad", 0.0, 5.0, nuisance=True)]
    narrow = [unknown("a", "rad", 1.0, 1.0), unknown("n", "rad", 0.0, 0.01, nuisance=True)]
    assert judged(J, np.array([1.0, 0.0]), wide).known == ()
    report = judged(J, np.array([1.0, 0.0]), narrow)
    assert report.known == ("a",)
    assert [p.name for p in report.parameters] == ["a"]


@pytest.mark.parametrize(
    ("unit", "power"),
    [("kg", 1), ("kg·m²", 1), ("N·m/A", 1), ("N·m·s/rad", 1), ("m", 0), ("V·s/rad", 0), ("rad/(N·m)", -1), ("1", 0)],
)
def test_torque_in_a_unit(unit: str, power: int) -> None:
    assert torque_power(unit) == power
