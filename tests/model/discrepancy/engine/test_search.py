"""Which candidates of a step are fitted, how far, and what a rival that was refused means for the next one."""

from dataclasses import replace

import pytest

from daq.contracts.progress import Never
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import fit
from model.discrepancy.engine.judging import judge
from model.discrepancy.engine.probing import Probe, Trial
from model.discrepancy.engine.search import OF_A_JOINT, REFINED, SHORTLIST, _Search, _shortlist, search
from model.discrepancy.engine.step_record import _cannot_be_told
from model.discrepancy.engine.workflow import Workflow
from model.discrepancy.options import TorqueOptions
from model.discrepancy.thresholds import LARGER_PART
from tests.model.discrepancy.inverse_dynamics.searches import sliding

FRICTION = TorqueOptions(effects=("coulomb_friction", "viscous_friction"))


@pytest.fixture(scope="module")
def rubbing() -> Workflow:
    return sliding({"coulomb": 8.0}, FRICTION)


@pytest.fixture(scope="module")
def found(rubbing: Workflow) -> tuple[Fitted, ...]:
    return search(rubbing.found.now, rubbing.case, lambda _: 0.0, lambda *_: None, Never()).fitted


def probe(workflow: Workflow, effect: str, joint: int, gain: float) -> Probe:
    return Probe(Trial(effect, (joint,), workflow.found.model, (), (), ({},)), gain, {})


def test_of_a_joint_the_three_that_explain_most_of_it_are_fitted_beside_the_most_promising(
    rubbing: Workflow,
) -> None:
    """Seven effects of another joint promise more; of joint 1, only what explains the larger part is fitted as well."""
    left = rubbing.found.now.weighted(rubbing.found.now.row)
    whole = float(left @ left)
    others = [probe(rubbing, f"other_{k}", 2, 10 * whole + k) for k in range(SHORTLIST)]
    own = [probe(rubbing, f"own_{k}", 1, (0.9 - 0.05 * k) * whole) for k in range(OF_A_JOINT + 2)]
    small = [probe(rubbing, "small", 1, 0.45 * whole)]
    listed = [p[0].trial.effect for p in _shortlist([*others, *own, *small], rubbing.found.now, 12.0)[0]]
    assert set(listed[:SHORTLIST]) == {p.trial.effect for p in others}
    assert listed[SHORTLIST:] == ["own_0", "own_1", "own_2"]
    assert "small" not in [p[0].trial.effect for p in _shortlist([*others, *small], rubbing.found.now, 12.0)[0]]


def test_the_first_candidates_are_fitted_to_their_ends(rubbing: Workflow, found: tuple[Fitted, ...]) -> None:
    best = found[0]
    last = best.fit
    away = {name: value + 3.0 for name, value in last.values.items()}
    begun = fit(last.compared, last.unknowns, away, last.memory, rounds=0)
    assert begun.cost > last.cost + 10.0
    some = [replace(best, fit=begun, ended=False)] * (REFINED + 1)
    refined = _Search(rubbing.found.now, rubbing.case, {}).refined(some, Never())
    assert all(one.fit.cost == pytest.approx(last.cost, abs=0.5) for one in refined[:REFINED])
    assert refined[REFINED].fit is begun


@pytest.mark.parametrize(("share", "taken"), [(0.9, False), (1.1, True)])
def test_an_effect_with_less_than_half_the_evidence_of_a_refused_rival_is_not_named(
    rubbing: Workflow, found: tuple[Fitted, ...], share: float, taken: bool
) -> None:
    chosen = next(f for f in found if f.effect == "coulomb_friction")
    rival = replace(chosen, effect="viscous_friction", evidence=chosen.evidence / (share * LARGER_PART))
    assert (judge(rubbing.found, chosen, [rival]) is not None) is taken
    elsewhere = replace(rival, joints=(2,))
    assert judge(rubbing.found, chosen, [elsewhere]) is not None, "it explains another joint's torque"


@pytest.mark.parametrize(
    ("parameters", "behind", "open_"), [(1, 11.0, True), (1, 13.0, False), (3, 24.0, True), (3, 27.0, False)]
)
def test_records_leave_open_what_differs_by_the_cost_of_parameters_alone(
    found: tuple[Fitted, ...], parameters: int, behind: float, open_: bool
) -> None:
    """A parameter costs 8 here, of which noise brings 1: two more are 14 beyond the lead of 12."""
    chosen = replace(found[0], evidence=100.0, cost=8.0)
    own = tuple(replace(chosen.parameters[0], name=f"p{k}") for k in range(parameters))
    rival = replace(chosen, parameters=own, evidence=100.0 - behind, cost=8.0 * parameters)
    assert _cannot_be_told(TorqueOptions(), chosen, rival) is open_
    if parameters > 1:
        small = replace(chosen, evidence=25.0), replace(rival, evidence=25.0 - 16.0)
        assert not _cannot_be_told(TorqueOptions(), *small), "what would not be suspected by itself is no rival"
