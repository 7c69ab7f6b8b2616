"""Coordinates of bodies that can exist: log-Cholesky parameters, what they refuse, and a fit of motion in them."""

from dataclasses import replace

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from daq.contracts.errors import SpecError
from daq.contracts.machine import parse_machine
from daq.contracts.trace import Trace
from model.arrays import Floats
from model.fitting.choice import chosen_unknowns
from model.fitting.consistent_bodies import (
    ENTRIES,
    ConsistentBodies,
    body_of,
    coordinates_of,
    log_cholesky,
    matrix_of,
    second_moments,
)
from model.fitting.fit import fit
from model.fitting.options import FitOptions
from model.fitting.profile import profile
from model.machine_model.model import Model, base_model
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.simulation.machines import PENDULUM, SLIDE
from tests.model.simulation.records import trace_of

ALL = ("link1.mass", "link1.centre_*", "link1.inertia_*")
INERTIAS = ("xx", "yy", "zz", "xy", "xz", "yz")


def of_body(*moments: float, mass: float = 1.2, text: str = PENDULUM, zz: str = "") -> Model:
    """The pendulum with a body in place of its rod."""
    numbers = [f'{{ value = {m}, unit = "kg·m²", source = "test"{zz if k == 2 else ""} }}'
               for k, m in enumerate(moments)]  # fmt: skip
    centre = ", ".join(f'{{ value = {c}, unit = "m", source = "test" }}' for c in (-0.25, 0.02, 0.01))
    body = f"centre = [{centre}]\ninertia = [{', '.join(numbers)}]\n"
    found = text.replace('shape = "rod"\n', 'shape = "body"\n' + body)
    for old in ("1.2", "2.0"):
        found = found.replace(f'mass = {{ value = {old}, unit = "kg"', f'mass = {{ value = {mass}, unit = "kg"')
    return base_model(parse_machine(found))


SOUND = (0.02, 0.03, 0.04, 0.002, -0.003, 0.001)


def of(model: Model, *parameters: str, **options: object) -> ConsistentBodies:
    chosen = FitOptions(parameters=parameters, consistent_inertias=True, **options)  # type: ignore[arg-type]
    found = coordinates_of(model, chosen_unknowns(model, chosen), chosen)
    assert isinstance(found, ConsistentBodies)
    return found


def refused(model: Model, *parameters: str, **options: object) -> str:
    with pytest.raises(SpecError) as told:
        of(model, *parameters, **options)
    assert "\n" not in str(told.value)
    return str(told.value)


def least_share(model: Model) -> float:
    second = second_moments(np.array([model.parameter(f"link1.inertia_{e}").value for e in INERTIAS]))
    return float(np.linalg.eigvalsh(second)[0] / np.trace(second))


CHOICES = [
    ALL,
    ("link1.mass", "link1.inertia_*"),
    ("link1.inertia_*",),
    ("link1.inertia_xx", "link1.inertia_yy", "link1.inertia_zz"),
    ("link1.mass", "link1.centre_x", "link1.inertia_xx", "link1.inertia_yy", "link1.inertia_zz", "link1.inertia_xz"),
    ("link1.mass", "link1.centre_*"),
    ("link1.length", "link1.mass", "link1.inertia_*"),
]


@pytest.mark.parametrize("parameters", CHOICES)
def test_values_come_back_and_derivatives_are_those_of_differences(parameters: tuple[str, ...]) -> None:
    model = of_body(*SOUND)
    found = of(model, *parameters)
    starts = np.array([model.parameter(u.name).value for u in found.unknowns])
    np.testing.assert_allclose(found.of_values(starts), 0.0, atol=1e-12)
    np.testing.assert_allclose(found.values(np.zeros(len(starts))), starts, rtol=1e-12)
    x = 0.3 * np.random.default_rng(1).normal(size=len(starts))
    values = found.values(x)
    assert not np.allclose(values, starts)
    np.testing.assert_allclose(found.of_values(values), x, atol=1e-9)
    moved = model.with_values(dict(zip([u.name for u in found.unknowns], map(float, values), strict=True)))
    assert least_share(moved) > 0
    step = 1e-6 * np.eye(len(x))
    differences = np.array([(found.values(x + s) - found.values(x - s)) / 2e-6 for s in step]).T
    np.testing.assert_allclose(found.derivatives(x), differences, atol=1e-7 * np.abs(differences).max())
    np.testing.assert_allclose(found.chain(x, np.eye(len(x))), found.derivatives(x))


def test_a_covariance_is_the_same_by_either_coordinates() -> None:
    rng, found = np.random.default_rng(2), of(of_body(*SOUND), *ALL)
    x, jacobian = 0.3 * rng.normal(size=10), rng.normal(size=(60, 10))
    information = jacobian.T @ jacobian
    slopes, turned = found.derivatives(x), found.chain(x, jacobian)
    np.testing.assert_allclose(
        slopes @ np.linalg.inv(turned.T @ turned) @ slopes.T, np.linalg.inv(information), rtol=1e-7
    )
    np.testing.assert_allclose(found.information_of_values(x, turned.T @ turned), information, rtol=1e-8, atol=1e-8)


@pytest.mark.parametrize("mass", [1.2, -0.3])
def test_values_of_no_body_become_those_of_one_on_the_way_to_them(mass: float) -> None:
    found = of(of_body(*SOUND), *ALL)
    wanted = np.array([mass, -0.25, 0.02, 0.01, 0.02, 0.03, 0.09, 0.002, -0.003, 0.001])
    x: Floats = found.of_values(wanted)
    values = found.values(x)
    assert values[0] > 0
    assert np.linalg.eigvalsh(second_moments(values[4:]))[0] > 0
    assert 0.04 < values[6] < 0.09


def test_bounds_of_a_mass_hold_and_those_of_moments_are_refused() -> None:
    found = of(of_body(*SOUND), *ALL, bounds={"link1.mass": (0.9, 1.5)})
    for end, mass in ((found.low, 0.9), (found.high, 1.5)):
        x = np.zeros(10)
        x[0] = end[0]
        assert found.values(x)[0] == pytest.approx(mass, rel=1e-12)
        assert 0.9 <= found.values(x)[0] <= 1.5
    bounded = of_body(*SOUND, zz=", low = 0.0, high = 0.2")
    assert refused(bounded, *ALL) == (
        "link1.inertia_zz: bounds 0 to 0.2 kg·m²: with consistent inertias a moment cannot have bounds; "
        "remove them, or state an expected deviation"
    )
    of(bounded, "link1.mass")


def test_what_cannot_be_is_refused_in_one_line() -> None:
    assert refused(of_body(0.002, 0.002, 0.01, 0, 0, 0), "link1.centre_x") == (
        "link1: 1.2 kg with the principal moments 0.002, 0.002, 0.01 kg·m² is not physically consistent (mass above 0, "
        "no moment above the sum of the others); consistent inertias must start from a consistent body"
    )
    assert "start from a mass and moments above 0" in refused(of_body(0, 0, 0, 0, 0, 0), *ALL)
    assert "start from a mass and moments above 0" in refused(of_body(*SOUND, mass=0.0), *ALL)
    assert refused(of_body(*SOUND), "link1.inertia_zz", "link1.inertia_xy") == (
        "link1.inertia_zz, link1.inertia_xy: with consistent inertias xx, yy and zz of a body are fitted together: "
        "fit link1.inertia_xx and link1.inertia_yy as well, or hold link1.inertia_*"
    )
    assert "nelder_mead" in refused(of_body(*SOUND), *ALL, method="nelder_mead")
    tied = of_body(*SOUND).tied("link1.round", ("link1.inertia_xx", "link1.inertia_yy"))
    assert "link1.round: sets several parameters at once" in refused(tied, "link1.round", "link1.inertia_zz")


def test_what_cannot_be_is_refused_a_plate_may_be_stated_and_without_a_body_nothing_changes() -> None:
    # They are on the edge of what can exist. A fit of the plate's moments starts a millionth inside
    plate = of(of_body(0.01, 0.02, 0.03, 0, 0, 0), *ALL)
    begun = plate.values(np.zeros(10))
    np.testing.assert_allclose(begun[4:7], [0.01, 0.02, 0.03], rtol=1e-5)
    assert np.linalg.eigvalsh(second_moments(begun[4:]))[0] > 0
    point = of(of_body(0, 0, 0, 0, 0, 0), "link1.mass", "link1.centre_*")
    np.testing.assert_allclose(point.values(np.zeros(4)), [1.2, -0.25, 0.02, 0.01])
    rod = base_model(parse_machine(PENDULUM))
    chosen = FitOptions(parameters=("link1.*",))
    unknowns = chosen_unknowns(rod, chosen)
    assert coordinates_of(rod, unknowns, chosen) is None
    found = of(rod, "link1.*")
    x = np.array([0.1, -0.2])
    np.testing.assert_array_equal(found.values(x), [u.start + u.scale * e for u, e in zip(unknowns, x, strict=True)])
    np.testing.assert_array_equal(found.derivatives(x), np.diag([u.scale for u in unknowns]))


def pushed(model: Model) -> Trace:
    """Two seconds of a swing under a recorded drive, with noise of a fine encoder."""
    time = 0.01 * np.arange(200)
    drive = (2.0 * np.sin(7 * time) + 1.5 * np.sin(11 * time) - 2.5)[:, None]
    made = trace_of(np.zeros((200, 1)), 0.01, drive=drive)
    found = simulate(model, made, Options(quantise=False, loop="open"))
    noise = 2e-3 * np.random.default_rng(4).standard_normal((200, 1))
    return replace(made, position=found.position + noise, velocity=found.velocity)


def test_a_fit_of_motion_finds_a_body_that_can_exist() -> None:
    """The motion is that of a drive's inertia that the model does not know. The moment about the axis takes it, and
    grows beyond what the other two allow."""
    with_rotor = PENDULUM + 'inertia = { value = 0.05, unit = "kg·m²", source = "" }'
    hidden = of_body(0.004, 0.03, 0.031, 0, 0, 0, text=with_rotor)
    swing = pushed(hidden)
    options = FitOptions(
        parameters=("link1.inertia_xx", "link1.inertia_yy", "link1.inertia_zz"),
        priors={},
        start_posture=False,
        replicas=0,
        rounds=2,
    )
    model = of_body(0.004, 0.03, 0.031, 0, 0, 0)
    plain = fit(model, [swing], options)
    held = fit(model, [swing], options.model_copy(update={"consistent_inertias": True}))
    assert least_share(plain.model) < 0
    assert least_share(held.model) > 0
    assert held.model.parameter("link1.inertia_zz").value == pytest.approx(0.081, rel=0.03)
    assert held.errors[0].after < 1.02 * plain.errors[0].after
    with pytest.raises(SpecError, match="not possible for a fit with consistent inertias"):
        profile(held, [swing], "link1.inertia_zz")


def test_searches_from_drawn_beginnings_stay_among_bodies_that_can_exist() -> None:
    model = of_body(*SOUND, text=SLIDE)
    made = trace_of(0.2 * np.sin(2 * np.pi * np.arange(100) / 50.0)[:, None], 0.01)
    found = simulate(model, made, Options(quantise=False))
    trace = replace(made, position=found.position, velocity=found.velocity, drive=found.drive)
    names = ("link1.mass", "link1.inertia_xx", "link1.inertia_yy", "link1.inertia_zz")
    short = FitOptions(parameters=names, sensor_bend=False, start_posture=False, replicas=0, rounds=1, starts=4)
    options = short.model_copy(update={"consistent_inertias": True})
    assert least_share(fit(model, [trace], options).model) > 0


# ---- Log-Cholesky parameters

FREE = np.zeros(3, dtype=bool)
SEVEN = arrays(float, 7, elements=st.floats(-3, 3))


def in_pinocchio(seven: Floats) -> pinocchio.LogCholeskyParameters:
    """The same body there, which has s23 before s13; its centre is at the origin."""
    a, d1, d2, d3, s12, s13, s23 = seven
    return pinocchio.LogCholeskyParameters(np.array([a, d1, d2, d3, s12, s23, s13, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize("seed", range(8))
def test_pinocchio_has_the_same_body_and_the_same_derivatives(seed: int) -> None:
    seven = np.random.default_rng(seed).normal(size=7)
    other = in_pinocchio(seven)
    found, slopes = body_of(seven, FREE, np.zeros(6))
    np.testing.assert_allclose(matrix_of(found), other.toInertia().inertia, rtol=1e-12, atol=1e-12)
    # Pinocchio: m, mc (3), Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the origin, by α, d (3), s12, s23, s13, t (3)
    theirs = np.array(other.calculateJacobian())[np.ix_([4, 6, 9, 5, 7, 8], [0, 1, 2, 3, 4, 6, 5])]
    np.testing.assert_allclose(slopes, theirs, rtol=1e-12, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.parametrize("held", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 1, 1)])
def test_derivatives_are_those_of_differences_and_held_products_stay(held: tuple[int, ...]) -> None:
    rng = np.random.default_rng(3)
    products, seven = np.array(held, dtype=bool), 0.5 * rng.normal(size=7)
    stated = np.array([0.0, 0.0, 0.0, 0.3, -0.2, 0.1])
    found, slopes = body_of(seven, products, stated)
    np.testing.assert_array_equal(found[3:][products], stated[3:][products])
    step = 1e-6 * np.eye(7)
    differences = [
        (body_of(seven + s, products, stated)[0] - body_of(seven - s, products, stated)[0]) / 2e-6 for s in step
    ]
    np.testing.assert_allclose(slopes, np.array(differences).T, atol=1e-7 * np.abs(slopes).max())
    np.testing.assert_array_equal(slopes[:, 4:][:, products], 0.0)
    again, _ = body_of(log_cholesky(np.exp(2 * seven[0]), found), products, stated)
    np.testing.assert_allclose(again, found, rtol=1e-9)


@given(SEVEN, arrays(bool, 3), arrays(float, 3, elements=st.floats(-1, 1)))
def test_whatever_the_numbers_the_body_can_exist(seven: Floats, held: Floats, products: Floats) -> None:
    moments, _ = body_of(seven, held, np.concatenate([np.zeros(3), products]))
    assert np.exp(2 * seven[0]) > 0
    least, middle, most = np.linalg.eigvalsh(matrix_of(moments))
    assert least > 0
    assert least + middle >= most * (1 - 1e-9), "but for rounding: a plate may be thinner than the digits show"
    assert np.linalg.eigvalsh(second_moments(moments))[0] >= -1e-9 * most


@given(SEVEN.filter(lambda seven: float(np.abs(seven).max()) < 1.5))
def test_a_body_of_ordinary_shape_satisfies_the_inequality_strictly(seven: Floats) -> None:
    moments, _ = body_of(seven, FREE, np.zeros(6))
    least, middle, most = np.linalg.eigvalsh(matrix_of(moments))
    assert least + middle > most
    np.testing.assert_allclose(log_cholesky(float(np.exp(2 * seven[0])), moments), seven, atol=1e-6)


def test_moments_of_no_body_have_no_parameters_and_entries_keep_the_file_s_order() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        log_cholesky(1.0, np.array([1.0, 1.0, 2.1, 0.0, 0.0, 0.0]))
    with pytest.raises(np.linalg.LinAlgError):
        log_cholesky(0.0, np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))
    assert ENTRIES == ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    np.testing.assert_array_equal(matrix_of(np.arange(6.0)), [[0, 3, 4], [3, 1, 5], [4, 5, 2]])
