"""Every effect against an outside integrator in continuous time, at the steps that fits and diagnoses use."""

import numpy as np
import pytest

from model.discrepancy.output_error.observation import STEP as STEP_OF_DIAGNOSES
from model.effects.library import library
from model.simulation.prepared import LONGEST_STEP as STEP_OF_FITS
from model.simulation.prepared import Options
from model.simulation.simulate import simulate
from tests.model.simulation.effect_cases import CASES, COUNT, Bench, Case, everything

LARGEST_ERROR, LARGEST_SHARE = 0.02, 0.05
"""Counts of the sensor, and share of the effect's own size."""
CONTACTS = {"stiction": 0.2, "backlash": 0.2}
"""Counts. Effects with corners that lie where they lie, not where a step ends: docs/modelling.md has their figures."""


@pytest.fixture(scope="module")
def bench() -> Bench:
    """0.6 s of motion, up and down; the outside integrator's steps of 25 µs are right to 0.0001 counts here."""
    return Bench(0.6, 2.5e-5)


def test_every_effect_of_the_library_has_its_case() -> None:
    assert {case.effect for case in CASES} == set(library())


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.effect)
def test_an_effect_is_integrated_to_a_twentieth_of_its_own_size(bench: Bench, case: Case) -> None:
    model = case.model(bench.base, case.shown_on)
    size, errors, _ = bench.measure(model, (STEP_OF_FITS, STEP_OF_DIAGNOSES))
    assert size > 0.25
    allowed = CONTACTS.get(case.effect, min(LARGEST_ERROR, LARGEST_SHARE * size))
    assert max(errors.values()) < allowed


CORNERS = ("stiction", "backlash", "joint_compliance")
EITHER = ("motor_inductance", "resistance_drift")
"""Not together: a winding warms by the current that its speed settles to, whatever its inductance."""


@pytest.mark.parametrize("general", [False, True], ids=["closed form", "recursive"])
@pytest.mark.parametrize("without", EITHER)
def test_all_effects_on_all_joints_at_once_are_integrated(bench: Bench, without: str, general: bool) -> None:
    model = everything(bench.base, (*CORNERS, without))
    exact = bench.exact(model)
    found = simulate(model, bench.inputs, Options(quantise=False, general=general)).reading
    assert np.abs(exact - bench.exact(bench.base)).max(axis=0).min() > 20 * COUNT, "every joint moves otherwise"
    assert np.abs(found - exact).max() < LARGEST_ERROR * COUNT


def test_all_effects_on_joints_that_give_are_integrated(bench: Bench) -> None:
    model = everything(bench.base, ("stiction", "backlash", "motor_inductance"))
    found = simulate(model, bench.inputs, Options(quantise=False)).reading
    assert np.abs(found - bench.exact(model)).max() < 10 * LARGEST_ERROR * COUNT
