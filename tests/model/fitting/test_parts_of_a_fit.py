"""The arithmetic between simulation and result, small enough to be done by hand; and what a fit may change."""

import math

import numpy as np
import pytest
from scipy.optimize import rosen

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.progress import Never
from model.arrays import Floats
from model.fitting.covariance import sandwich
from model.fitting.fit import fit_problem, fitted_parameter
from model.fitting.identifiability import judged
from model.fitting.least_squares import Search, huber, influence, solve
from model.fitting.nelder_mead import climb
from model.fitting.options import FitOptions
from model.fitting.problem import Evaluation, whitened
from model.fitting.unknowns import Unknown, prior_precision, scales
from model.fitting.whitening import fitted_whitener, white
from model.machine_model.parameter import Kind, Parameter
from tests.model.fitting.imagined import arm
from tests.model.fitting.problems import Formula, free
from tests.model.fitting.test_identifiability import unknown
from tests.model.fitting.test_records import record_of

# ---- what one parameter's result says


def named(value: float, deviation: float, verdict: str, **fields: float) -> dict[str, object]:
    """The result for a mass of 1 kg between 0.5 and 3 kg, expected 1.1 ± 0.2 kg."""
    jacobian = np.array([[100.0 if verdict == "known" else 0.01]])
    mass = Parameter(name="load.mass", kind=Kind.INERTIA, part="mass", unit="kg", value=1.0)
    own = Unknown(mass, 1.0, **{"low": 0.5, "high": 3.0, "expected": 1.1, "deviation": 0.2, **fields})
    report = judged(jacobian, np.array([value]), [own])
    assert report.verdict("load.mass").verdict == verdict
    return dict(fitted_parameter(own, value, deviation, report.verdict("load.mass")))


def test_what_a_fit_knows_has_an_interval_within_bounds_and_what_it_does_not_the_model_s_number() -> None:
    found = named(2.0, 0.1, "known")
    assert (found["value"], found["deviation"], found["model_value"], found["before"]) == (2.0, 0.1, 2.0, 1.0)
    assert (found["low"], found["high"]) == (pytest.approx(2.0 - 0.1959964), pytest.approx(2.0 + 0.1959964))
    assert (found["expected"], found["expected_deviation"], found["at_bound"]) == (1.1, 0.2, None)
    assert named(0.55, 0.1, "known")["low"] == 0.5
    assert named(2.95, 0.1, "known")["high"] == 3.0
    found = named(2.0, 0.1, "unknown")
    assert [found[name] for name in ("value", "deviation", "low", "high")] == [None] * 4
    assert found["model_value"] == 2.0
    mass = Parameter(name="load.mass", kind=Kind.INERTIA, part="mass", unit="kg", value=1.0)
    own = Unknown(mass, 1.0, expected=1.1)
    verdict = judged(np.array([[100.0]]), np.ones(1), [own]).verdict("load.mass")
    assert fitted_parameter(own, 1.0, 0.1, verdict).expected is None
    assert verdict.reason == "the data alone determine it to 0.01 of its value"
    assert verdict.expected_deviation is None


@pytest.mark.parametrize(
    ("value", "at"), [(0.5, "low"), (0.5 + 1e-7, "low"), (0.5 + 3e-7, None), (3.0 - 1e-7, "high"), (3.0 - 3e-7, None)]
)
def test_a_value_within_a_millionth_of_its_size_of_a_bound_lies_at_it(value: float, at: str | None) -> None:
    assert named(value, 0.1, "known")["at_bound"] == at


# ---- verdicts


def test_a_parameter_is_known_where_the_data_leave_half_of_its_size_unless_others_stand_in() -> None:
    for slope, verdict in ((2.01, "known"), (1.99, "unknown")):
        report = judged(np.array([[slope]]), np.ones(1), [unknown("a", "m", 1.0, 1.0)])
        assert report.verdict("a").verdict == verdict
    told = judged(np.array([[20.0]]), np.ones(1), [unknown("a", "m", 1.0, 0.5)]).verdict("a")
    assert told.reason == "the data alone determine it to 0.1 of its expected deviation"
    assert (told.data_deviation, told.alone, told.expected_deviation) == (pytest.approx(0.05), pytest.approx(0.05), 0.5)
    jacobian = np.array([[10.0, 10.0]])
    told = judged(jacobian, np.ones(2), [unknown("a", "m", 1.0, 0.5), unknown("b", "m", 1.0, 0.5)]).verdict("a")
    assert told.verdict == "combination"
    assert told.reason.startswith("alone it would be known to 0.2 of its expected deviation, but others can compensate")
    assert told.reason.endswith((": together a +1 %, b −1 %", ": together a −1 %, b +1 %"))
    assert (told.alone, told.data_deviation) == (pytest.approx(0.1), None)


@pytest.mark.parametrize(("slope", "told"), [(1 / 29.0, 29.0), (1 / 31.0, None)])
def test_a_deviation_of_more_than_thirty_sizes_is_not_told(slope: float, told: float | None) -> None:
    found = judged(np.array([[slope]]), np.ones(1), [unknown("a", "m", 1.0, 1.0)]).verdict("a")
    assert found.data_deviation == (None if told is None else pytest.approx(told, rel=1e-3))
    assert found.reason.startswith(f"its expected deviation changes these records by {slope:.2g} standard deviations")


@pytest.mark.parametrize(("correlation", "together"), [(0.949, False), (0.951, True)])
def test_estimates_correlated_by_more_than_19_in_20_belong_together(correlation: float, together: bool) -> None:
    covariance = 1e-6 * np.array([[1.0, correlation], [correlation, 1.0]])
    jacobian = np.linalg.cholesky(np.linalg.inv(covariance)).T
    report = judged(jacobian, np.ones(2), [unknown("a", "V", 1.0, 1.0), unknown("b", "V", 1.0, 1.0)])
    assert report.correlated == ((("a", "b"),) if together else ())


def test_estimates_in_a_chain_are_one_group_and_a_change_of_zero_is_in_its_own_unit() -> None:
    steps = np.cumsum(np.eye(3), axis=0)  # each next one is the one before and a little more
    covariance = 1e-6 * (steps * [1.0, 0.05, 0.05]) @ steps.T
    jacobian = np.linalg.cholesky(np.linalg.inv(covariance)).T
    report = judged(jacobian, np.ones(3), [unknown(name, "V", 1.0, 1.0) for name in "cab"])
    assert report.correlated == (("c", "a", "b"),)
    jacobian = np.array([[10.0, 10.0]])
    unknowns = [unknown("a", "V", 0.0, 2.0), unknown("b", "V", 0.0, 2.0)]
    (only,) = judged(jacobian, np.zeros(2), unknowns).undetermined
    assert only.text in ("together a +0.02 V, b −0.02 V", "together a −0.02 V, b +0.02 V")
    assert not any(member.relative for member in only.members)
    assert only.deviation is None


# ---- losses, whitening, covariance


def test_huber_s_loss_grows_straight_beyond_four_deviations_for_data_alone() -> None:
    squares = np.array([9.0, 16.0, 100.0, 100.0])
    loss, slope, curvature = huber(squares, 3)
    np.testing.assert_allclose(loss, [9.0, 16.0, 2 * 4 * 10 - 16, 100.0])
    np.testing.assert_allclose(slope, [1.0, 1.0, 0.4, 1.0])
    np.testing.assert_allclose(curvature, [0.0, 0.0, -0.5 * 4 / 1000, 0.0])
    np.testing.assert_allclose(influence(np.array([-9.0, -4.0, 1.0, 5.0])), [-4.0, -4.0, 1.0, 4.0])


class Two:
    """Two records of two signals, the first in two stretches, with the derivatives by one unknown."""

    runs = ((slice(0, 2), slice(3, 5)), (slice(1, 3),))
    residual = (np.arange(10.0).reshape(5, 2), 10.0 * np.arange(6.0).reshape(3, 2))

    def evaluations(self) -> list[Evaluation]:
        return [Evaluation(r, -r[None]) for r in self.residual]


def test_stretches_are_whitened_signal_by_signal_and_stand_one_behind_the_other() -> None:
    data = whitened(Two(), Two().evaluations(), [white(1.0), white(2.0)])  # type: ignore[arg-type]
    rows = [(0, 0.5), (2, 1.5), (6, 3.5), (8, 4.5), (20, 15), (40, 25)]
    np.testing.assert_allclose(data.residual, rows)
    np.testing.assert_allclose(data.jacobian[:, :, 0], -np.array(rows))
    assert data.starts == (0, 2, 4, 6)
    squares = [a * a + b * b for a, b in rows]
    np.testing.assert_allclose(data.information, [[sum(squares)]])
    assert [s[:, 0].tolist() for s in data.scores()] == [[-s for s in squares[k : k + 2]] for k in (0, 2, 4)]
    ones = data.scores(np.ones((6, 2)))
    np.testing.assert_allclose(np.concatenate(ones)[:, 0], [-a - b for a, b in rows])


def test_a_plain_sandwich_is_done_by_hand_and_a_filter_s_memory_is_a_twentieth() -> None:
    # Four samples of one parameter: scores 1, −1, 2, 0 of its own, no neighbours counted
    scores = [np.array([[1.0], [-1.0], [2.0], [0.0]])]
    middle = 6.0 * 4 / 3 + 0.5
    found = sandwich(np.array([[2.0]]), scores, np.array([0.5]), bandwidth=0)
    np.testing.assert_allclose(found, [[middle / 2.5**2]])
    least = sandwich(np.array([[20.0]]), scores, np.array([0.5]), bandwidth=0)
    np.testing.assert_allclose(least, [[1 / 20.5]])
    wave = [np.sin(0.3 * np.arange(count)) for count in (19, 39, 40, 60)]
    assert [fitted_whitener([one], 8, floor=1e-9).order for one in wave] == [0, 1, 2, 3]
    assert fitted_whitener([wave[3]], 2, floor=1e-9).order == 2


# ---- searches


def rosenbrock(high: float = math.inf, fails_beyond: float = math.inf) -> Formula:
    """Residuals of Rosenbrock's valley, whose lowest point is (1, 1)."""

    def residual(v: Floats) -> Floats:
        if v[0] > fails_beyond:
            raise SpecError("it does not stay finite")
        return np.array([10.0 * (v[1] - v[0] ** 2), 1.0 - v[0]])

    unknowns = tuple(free(n, -0.5, -2.0, high, size=0.5) for n in "xy")
    return Formula(np.zeros(2), residual, lambda v: np.array([[-20.0 * v[0], -1.0], [10.0, 0.0]]), unknowns)


START = np.array([-0.5, -0.5])


def test_the_simplex_finds_the_lowest_point_and_says_what_it_costs() -> None:
    problem, told = rosenbrock(), []
    found = climb(problem, START, Never(), 2000, 1e-9, lambda count, rms: told.append((count, rms)))
    np.testing.assert_allclose(found.values, [1.0, 1.0], atol=1e-4)
    assert found.converged
    assert found.evaluations == len(problem.tried) == len(told)
    assert [count for count, _ in told] == list(range(1, len(told) + 1))
    assert told[0][1] == pytest.approx(math.sqrt(rosen(START) / 2))
    assert found.cost == pytest.approx(min(rms for _, rms in told) ** 2)
    np.testing.assert_allclose(problem.tried[:3], [(-0.5, -0.5), (0.0, -0.5), (-0.5, 0.0)])


def test_the_simplex_starts_towards_more_room_and_ends_at_its_goal() -> None:
    problem = rosenbrock(high=0.9)
    found = climb(problem, np.array([0.5, 0.6]), Never(), 2000, 1e-9)
    np.testing.assert_allclose(problem.tried[:3], [[0.5, 0.6], [0.0, 0.6], [0.5, 0.1]])
    assert max(values.max() for values in problem.tried) <= 0.9
    np.testing.assert_allclose(found.values, [0.9, 0.81], atol=1e-3)
    found = climb(rosenbrock(), START, Never(), 2000, 1e-9, goal=0.5)
    assert (found.converged, found.message) == (True, "the requested error is reached")
    assert found.cost <= 0.5
    short = climb(rosenbrock(), START, Never(), 10, 1e-9)
    assert (short.converged, short.evaluations) == (False, 10)


def test_searches_turn_back_where_the_simulation_diverges_and_say_when_they_cannot_begin() -> None:
    assert climb(rosenbrock(fails_beyond=0.5), START, Never(), 2000, 1e-9).values[0] <= 0.5
    found = solve(rosenbrock(fails_beyond=0.5), [white(1.0)], START, Never(), Search(False, 1e-9, 200))
    assert found.values[0] <= 0.5
    assert found.cost < 0.5 * rosen(START)
    with pytest.raises(SpecError, match="does not stay finite"):
        solve(rosenbrock(fails_beyond=-1.0), [white(1.0)], START, Never())
    problem = rosenbrock(high=0.5)
    solve(problem, [white(1.0)], np.array([-2.0, 0.5]), Never(), Search(False, 1e-9, 1))
    np.testing.assert_allclose(problem.tried[0], [-2.0 + 0.5e-3, 0.5 - 0.5e-3])
    ten = [record_of(list(range(10)), still=0)]
    names = tuple(p.name for p in arm().parameters)
    assert len(fit_problem(arm(), ten, FitOptions(parameters=names[:9])).unknowns) > 9, "nuisances do not count"
    with pytest.raises(TraceError, match="10 samples for 10 parameters: there must be more samples than parameters"):
        fit_problem(arm(), ten, FitOptions(parameters=names[:10]))


def test_a_search_tells_its_evaluations_and_gives_the_information_at_its_end() -> None:
    told: list[tuple[int, float]] = []
    search = Search(False, 1e-12, 200, lambda count, rms: told.append((count, rms)))
    found = solve(rosenbrock(), [white(2.0)], START, Never(), search)
    assert found.converged
    np.testing.assert_allclose(found.values, [1.0, 1.0], atol=1e-6)
    assert [count for count, _ in told] == list(range(1, found.evaluations + 1))
    assert told[0][1] == pytest.approx(math.sqrt(rosen(START) / 2) / 2)
    J = np.array([[-20.0, -1.0], [10.0, 0.0]]).T / 2
    assert found.information is not None
    np.testing.assert_allclose(found.information, J.T @ J, rtol=1e-4)


def test_what_is_expected_pulls_as_its_deviation_says() -> None:
    """One straight unknown: the data say 3 ± 1, the prior 1 ± 0.5, so the answer is their weighted mean."""
    unknown = free("x", 0.0, expected=1.0, deviation=0.5)
    problem = Formula(np.array([3.0]), lambda v: v, lambda _: np.ones((1, 1)), (unknown,))
    found = solve(problem, [white(1.0)], np.zeros(1), Never(), Search(False, 1e-12))
    assert found.values[0] == pytest.approx((3.0 + 4 * 1.0) / 5)
    assert found.cost == pytest.approx(0.5 * (1.6**2 + (0.4 / 0.5) ** 2))
    assert found.information[0, 0] == pytest.approx(1 + 4)


# ---- what is fitted


def test_nuisances_are_fitted_as_the_options_say() -> None:
    given = [record_of(list(range(100)))]

    def kinds(**options: object) -> tuple[int, int, int]:
        problem = fit_problem(arm(), given, FitOptions(parameters=("load.mass",), **options))  # type: ignore[arg-type]
        names = [u.name for u in problem.unknowns if u.nuisance]
        bends = sum("nonlinearity" in name for name in names)
        forms = sum("presliding" in name for name in names)
        assert (problem.signal, problem.loop) == ("position", options.get("loop", "closed"))
        return bends, forms, len(names) - bends - forms

    assert kinds(sensor_bend=True, bend_terms=2) == (6, 6, 3)
    assert kinds(sensor_bend=False) == (0, 6, 3)
    assert kinds(sensor_bend=False, friction_form=False) == (0, 0, 3)
    assert kinds(sensor_bend=False, start_posture=False) == (0, 6, 0)
    assert kinds(sensor_bend=True, method="nelder_mead") == (0, 0, 0)
    assert kinds(sensor_bend=False, loop="open") == (0, 6, 3)


# ---- What a fit may change: impossible searches are refused, and every unknown has a natural size

MASS = Parameter(name="load.mass", kind=Kind.INERTIA, part="mass", unit="kg", value=0.5)


def one_unknown(start: float = 0.5, **fields: float | None) -> Unknown:
    return Unknown(MASS, start, **fields)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("fields", "says"),
    [
        ({"low": 1.0, "high": 1.0}, "load.mass: lower bound 1 kg is not below the upper 1"),
        ({"start": 0.4, "low": 0.5}, "starting value 0.4 kg is outside 0.5 to inf"),
        ({"start": 0.6, "high": 0.5}, "starting value 0.6 kg is outside -inf to 0.5"),
        ({"deviation": 0.0}, "expected deviation 0 kg must be above 0"),
        ({"deviation": -1.0}, "expected deviation -1 kg must be above 0"),
        ({"deviation": math.inf}, "expected deviation inf kg must be above 0"),
    ],
)
def test_an_impossible_search_is_refused(fields: dict[str, float], says: str) -> None:
    with pytest.raises(SpecError, match=says):
        one_unknown(**fields)


def test_a_search_may_begin_at_a_bound_and_a_size_is_the_expected_deviation_or_the_next_best() -> None:
    assert one_unknown(0.5, low=0.5, high=1.0).start == 0.5
    assert one_unknown(1.0, low=0.5, high=1.0).start == 1.0
    every = (
        one_unknown(-0.5, deviation=0.1, size=3.0),
        one_unknown(-0.5, size=3.0),
        one_unknown(-0.5, low=-1.0),
        one_unknown(0.0, low=-1.0, high=4.0),
        one_unknown(0.0, low=-1.0),
    )
    np.testing.assert_array_equal(scales(every), [0.1, 3.0, 0.5, 5.0, 1.0])
    np.testing.assert_allclose(prior_precision(every), [100.0, 0.0, 0.0, 0.0, 0.0])
