"""Log-Cholesky parameters: against the published matrix written out, against Pinocchio's, and for whatever numbers."""

import numpy as np
import pinocchio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from model.arrays import Floats
from model.fitting.log_cholesky import ENTRIES, body_of, log_cholesky, matrix_of, second_moments

FREE = np.zeros(3, dtype=bool)
SEVEN = arrays(float, 7, elements=st.floats(-3, 3))


def published(seven: Floats, centre: Floats) -> Floats:
    """J = U Uᵀ as Rucker and Wensing print U."""
    a, d1, d2, d3, s12, s13, s23 = seven
    rows = [
        [np.exp(d1), s12, s13, centre[0]],
        [0.0, np.exp(d2), s23, centre[1]],
        [0.0, 0.0, np.exp(d3), centre[2]],
        [0.0, 0.0, 0.0, 1.0],
    ]
    upper = np.exp(a) * np.array(rows)
    return np.asarray(upper @ upper.T)


def in_pinocchio(seven: Floats) -> pinocchio.LogCholeskyParameters:
    """The same body there, which has s23 before s13; its centre is at the origin."""
    a, d1, d2, d3, s12, s13, s23 = seven
    return pinocchio.LogCholeskyParameters(np.array([a, d1, d2, d3, s12, s23, s13, 0.0, 0.0, 0.0]))


@pytest.mark.parametrize("seed", range(8))
def test_mass_centre_and_moments_are_those_of_the_published_matrix(seed: int) -> None:
    rng = np.random.default_rng(seed)
    seven, centre = rng.normal(size=7), rng.normal(size=3)
    pseudo = published(seven, centre)
    mass = pseudo[3, 3]
    assert np.exp(2 * seven[0]) == pytest.approx(mass)
    np.testing.assert_allclose(pseudo[:3, 3] / mass, centre)
    about_origin = np.trace(pseudo[:3, :3]) * np.eye(3) - pseudo[:3, :3]
    about_centre = about_origin - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    found, _ = body_of(seven, FREE, np.zeros(6))
    np.testing.assert_allclose(matrix_of(found), about_centre, atol=1e-11 * np.abs(about_origin).max())
    np.testing.assert_allclose(log_cholesky(mass, found), seven, atol=1e-8)


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


def test_moments_of_no_body_have_no_parameters() -> None:
    with pytest.raises(np.linalg.LinAlgError):
        log_cholesky(1.0, np.array([1.0, 1.0, 2.1, 0.0, 0.0, 0.0]))
    with pytest.raises(np.linalg.LinAlgError):
        log_cholesky(0.0, np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]))


def test_the_entries_are_in_the_order_of_the_machine_file() -> None:
    assert ENTRIES == ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
    np.testing.assert_array_equal(matrix_of(np.arange(6.0)), [[0, 3, 4], [3, 1, 5], [4, 5, 2]])
