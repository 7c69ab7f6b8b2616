"""The whole reproduction on the ramp that the command records, of a plant with complete friction."""

import pytest

from daq.contracts.errors import SpecError
from extras.thesis.command import as_text
from extras.thesis.ladder import Ladder
from extras.thesis.reproduction import Reproduction, reproduce_thesis


@pytest.fixture(scope="module")
def ladder(result: Reproduction) -> Ladder:
    return result.ladders[0]


def test_every_step_of_the_ladder_fits_better_and_explains_more(ladder: Ladder) -> None:
    errors = [s.error for s in ladder.steps]
    sums = [s.fidelity.sum_of_contributions for s in ladder.steps]
    assert errors == sorted(errors, reverse=True)
    assert sums == sorted(sums)
    assert ladder.unoptimised_error > errors[0]


def test_back_emf_of_joint_2_stands_in_for_friction_until_there_is_some(ladder: Ladder) -> None:
    _, with_back_emf, viscous, complete = ladder.steps
    assert with_back_emf.values["Kb2"] > 0.06
    assert viscous.values["Kb2"] == pytest.approx(0.0334, rel=0.2)
    assert complete.values["Kb2"] == pytest.approx(0.0334, rel=0.2)
    assert complete.values["v_eff2"] == pytest.approx(2.53e-4, rel=0.25)


def test_the_waist_s_link_is_insensitive_throughout(ladder: Ladder) -> None:
    for step in ladder.steps:
        for name in ("link1.mass", "link1.radius"):
            assert step.fidelity.parameter(name).contribution < 0.01 * step.fidelity.sum_of_contributions


def test_only_the_known_statements_do_not_come_out(result: Reproduction) -> None:
    assert {c.name for c in result.failed} == {
        "table 5.1, joint 1",
        "table 5.2, joint 1",
        "with the tabled back-EMF constants cases 1 and 2 are damped",
        "PID from 90°: joint 3 overshoots",
    }


def test_text_shows_ours_beside_the_published(result: Reproduction) -> None:
    text = as_text(result)
    for shown in ("0.2449", "0.2426", "9.4940e-4"[:4], "start posture", "not given", "Found on the way"):
        assert shown in text
    assert Reproduction.model_validate_json(result.model_dump_json()) == result


def test_a_reproduction_without_traces_or_methods_is_refused() -> None:
    with pytest.raises(SpecError, match="at least one trace"):
        reproduce_thesis([])


def test_elements_of_the_inertia_matrix_are_those_of_the_equation_that_figure_7_12_names(result: Reproduction) -> None:
    """(7.28) takes link 3 and its load as one rod: D23 is 0.109 to 0.114 kg·m² there, and 0.101 to 0.105 exactly."""
    coupling = result.figures.analysis.element(2, 3).whole
    assert (min(coupling), max(coupling)) == pytest.approx((0.109, 0.114), abs=6e-4)


def test_the_findings_say_that_one_ramp_does_not_determine_the_parameters(result: Reproduction, ladder: Ladder) -> None:
    (said,) = (f for f in result.findings if "one ramp does not tell the 13 parameters" in f)
    assert f"MLOAD {ladder.steps[-1].values['MLOAD']:.3g} for 1.25" in said
