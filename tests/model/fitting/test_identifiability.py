"""Identifiability on Jacobians whose blind directions are known, and profile likelihoods."""

from functools import partial

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.progress import Never
from daq.contracts.service.jobs import ParameterWords
from model.arrays import Floats
from model.fitting.identifiability import judged, undetermined_in_words
from model.fitting.least_squares import Search, solve
from model.fitting.profile import RISE, Profile, profiled
from model.fitting.unknowns import Unknown
from model.fitting.whitening import Whitener, white
from model.machine_model.parameter import Kind, Parameter
from model.units import torque_power
from tests.model.fitting.problems import Formula, free

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


# ---- Profile likelihoods, held against a published one and against straight lines

SEARCH = Search(robust=False, tolerance=1e-12, most_evaluations=200)

CONCENTRATION = np.repeat([0.02, 0.06, 0.11, 0.22, 0.56, 1.10], 2)
VELOCITY = np.array([76, 47, 97, 107, 123, 139, 159, 152, 191, 201, 207, 200], dtype=float)
"""Treated cells of the puromycin data (Bates and Watts 1988, Nonlinear Regression Analysis, table A1.3)."""
STUDENT_T = 2.228139
"""97.5 % quantile of Student's t with the 10 degrees of freedom that 12 velocities leave 2 parameters."""


def enzyme() -> Formula:
    """V c/(K + c), Michaelis and Menten."""

    def velocity(v: Floats) -> Floats:
        return np.asarray(v[0] * CONCENTRATION / (v[1] + CONCENTRATION))

    def slopes(v: Floats) -> Floats:
        return np.array([velocity(v) / v[0], -velocity(v) / (v[1] + CONCENTRATION)])

    return Formula(VELOCITY, velocity, slopes, (free("V", 200.0), free("K", 0.05, 0.0, 10.0)))


def line(measured: Floats, slope: Unknown) -> Formula:
    """A straight line's slope, and a number that has nothing to show."""
    J = np.stack([np.linspace(0, 1, len(measured)), np.zeros(len(measured))])
    return Formula(measured, lambda v: v @ J, lambda _: J, (slope, free("nothing", 1.0, -5.0, 5.0)))


def cliff(fails: bool) -> Formula:
    """Flat to 2, then too steep for a straight line between two trials, or no simulation that stays finite."""

    def over(v: Floats) -> Floats:
        if fails and v[0] > 2.0:
            raise SpecError("the simulation does not stay finite")
        return np.full(20, 1e4 * max(0.0, v[0] - 2.0))

    unknowns = (free("slope", 1.0, -5.0, 50.0), free("nothing", 1.0, -5.0, 5.0))
    return Formula(np.zeros(20), over, lambda v: np.outer([1e4 * (v[0] > 2.0), 0.0], np.ones(20)), unknowns)


def of(problem: Formula, index: int, size: float, noise: float, rise: float = RISE) -> Profile:
    whiteners: list[Whitener] = [white(noise)]
    begin = np.array([u.start for u in problem.unknowns])
    best = solve(problem, whiteners, begin, Never(), SEARCH)
    return profiled(problem, whiteners, best.values, index, size, SEARCH, rise=rise)


def test_the_intervals_of_the_puromycin_data_are_those_that_r_computes() -> None:
    """`confint` of R (package MASS) on `nls(rate ~ Vm * conc/(K + conc), Puromycin, subset = state == "treated")`."""
    problem = enzyme()
    residual = solve(problem, [white(1.0)], np.array([200.0, 0.05]), Never(), SEARCH)
    noise = float(np.sqrt(2 * residual.cost / 10))
    assert residual.values == pytest.approx([212.7, 0.06412], rel=1e-3)
    largest, half = (of(problem, k, size, noise, STUDENT_T**2) for k, size in ((0, 7.0), (1, 0.008)))
    assert (largest.low, largest.high) == pytest.approx((197.3021, 229.2901), rel=2e-4)
    assert (half.low, half.high) == pytest.approx((0.04692517, 0.08615995), rel=2e-3)


def test_a_straight_line_has_the_interval_of_its_deviation_and_a_prior_of_its_own_takes_no_part() -> None:
    measured = 3.0 * np.linspace(0, 1, 50)
    found = of(line(measured, free("slope", expected=0.0, deviation=0.01)), 0, 0.1, 0.2)
    deviation = 0.2 / np.linalg.norm(np.linspace(0, 1, 50))
    assert (found.low - 3.0, found.high - 3.0) == pytest.approx((-1.959964 * deviation, 1.959964 * deviation), rel=2e-3)
    assert found.rises == pytest.approx([((value - 3.0) / deviation) ** 2 for value in found.values], abs=1e-6)


def test_a_profile_ends_at_a_cliff_or_nowhere() -> None:
    for fails in (False, True):
        found = of(cliff(fails), 0, 0.3, 0.2)
        assert found.high == pytest.approx(2.0, abs=0.05), fails
        assert found.low is None
        assert all(np.isfinite(found.rises))
    found = of(line(np.linspace(0, 1, 50), free("slope")), 1, 0.1, 0.2)
    assert (found.low, found.high, found.better) == (None, None, False)
    assert (found.values[0], found.values[-1]) == (-5.0, 5.0)
    assert found.rises == pytest.approx([0.0] * len(found.rises), abs=1e-9)


def test_progress_of_a_profile_grows_to_one() -> None:
    told: list[float] = []
    profiled(
        enzyme(), [white(10.9)], np.array([212.7, 0.064]), 0, 2.0, SEARCH, progress=lambda share, _: told.append(share)
    )
    assert told == sorted(told)
    assert (told[0], told[-1]) == (0.0, 1.0)
    assert sum(0.5 < share < 1.0 for share in told) > 1
