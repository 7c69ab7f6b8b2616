"""What a later effect makes superfluous."""

from dataclasses import replace

import pytest

from daq.contracts.progress import Never
from model.discrepancy.diagnosis import FoundValue
from model.discrepancy.engine.candidate import Fitted
from model.discrepancy.engine.fitting import LONG, fit
from model.discrepancy.engine.priors import free_unknown
from model.discrepancy.engine.workflow import Workflow
from tests.model.discrepancy.readings.cases import case_of
from tests.model.discrepancy.steps import step
from tests.model.fitting import imagined


@pytest.mark.parametrize(("held_on", "left"), [((2, 3), ((2, 3), True)), ((3,), ((3,), True)), ((), ((2, 3), False))])
def test_an_effect_loses_joints_that_another_one_has_made_superfluous(
    held_on: tuple[int, ...], left: tuple[tuple[int, ...], bool]
) -> None:
    """As friction by direction that joint 2 had been given before the offset of its potentiometer was found."""
    name = "coulomb_friction"
    truth = imagined.arm()
    if held_on:
        truth = truth.with_effect(name, held_on, {"torque": 3.0})
    case = case_of(imagined.arm(), imagined.traces(truth))
    flow = Workflow(case, 12.0, lambda *_: None, Never())
    wider = flow.found.model.with_effect(name, (2, 3))
    own = tuple(p for p in wider.parameters if p.effect == name)
    first = flow.found.now
    unknowns = (*first.unknowns, *map(free_unknown, own))
    found = fit(first.compared.of_model(wider), unknowns, first.values, first.memory, rounds=LONG)
    adopted = step(name, (2, 3), parameters={p.name: FoundValue.of(p, found.values[p.name]) for p in own})
    taken = flow.found.take(Fitted(name, (2, 3), wider, own, found))
    flow.found = replace(taken, steps=(adopted,))
    flow._prune(1)
    (after,) = flow.found.steps
    assert (after.joints, after.adopted) == left
    assert {p.joints[0] for p in after.parameters.values()} == set(after.joints)
    assert {j for use in flow.found.model.effects if use.name == name for j in use.joints} == set(held_on)
