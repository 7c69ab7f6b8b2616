"""Every effect of the library is a trial of the closed loop: at every place once, at sizes that its bounds and the
records allow."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from model import layout as at
from model.discrepancy.engine.fitting import Fit, evaluate
from model.discrepancy.engine.probing import Trial
from model.discrepancy.options import DiagnosisOptions, reading_options
from model.discrepancy.readings.observation import Observation
from model.discrepancy.readings.trials import SHARES_OF_LIMIT, STICTION_SPEED, TIMES, list_trials
from model.effects.library import BESIDE, add_own, library, remove_own
from model.machine_model.model import Model
from tests.model.discrepancy.own_effects import own_effect
from tests.model.discrepancy.readings.cases import case_of
from tests.model.fitting import imagined

ARM = imagined.arm()


def listed(
    model: Model, effects: tuple[str, ...] | None = None, joints: tuple[int, ...] | None = None, volts: float = 1.0
) -> tuple[list[Trial], Observation, Fit]:
    """The trials on a second of a record whose drive never exceeds so much; nothing is fitted."""
    case = case_of(model, [imagined.trace(imagined.arm(), seconds=1.0)], effects=effects, joints=joints)
    observation = case.compared.observation
    records = []
    for r in observation.records:
        drive = np.zeros_like(r.inputs.drive)
        drive[0] = volts
        records.append(replace(r, inputs=replace(r.inputs, drive=drive, has_drive=True)))
    observation = replace(observation, records=tuple(records))
    unknowns = case.unknowns(model, {})
    now = evaluate(case.compared, unknowns, {u.name: u.start for u in unknowns}, np.ones(3))
    return list(list_trials(now, observation, case.options, case.excluded)), observation, now


@pytest.fixture(scope="module")
def all_trials() -> list[Trial]:
    return listed(ARM)[0]


def test_every_effect_is_tried_once_on_every_joint_where_it_can_be(all_trials: list[Trial]) -> None:
    """Stiction is two laws. Tones are left to spectra, and friction that goes with gravity to joints that feel it."""
    found = Counter((t.effect, t.joints) for t in all_trials)
    for name, effect in library().items():
        places = {joints for one, joints in found if one == name}
        if effect.tone is not None:
            assert not places
        elif effect.whole_machine:
            assert places == {()}, name
        elif name in BESIDE:
            has_it = {j for use in ARM.effects if use.name == BESIDE[name] for j in use.joints}
            assert places == {(j,) for j in has_it}, name
        else:
            assert places == ({(2,), (3,)} if name == "gravity_torque_friction" else {(1,), (2,), (3,)}), name
    assert {key for key, count in found.items() if count > 1} == {("stiction", (j,)) for j in (1, 2, 3)}
    laws = Counter((t.effect, t.law, t.joints) for t in all_trials)
    assert set(laws.values()) == {1}


def test_an_effect_that_needs_another_beside_it_is_tried_there_or_where_it_is_asked_for_by_name() -> None:
    for name, first in BESIDE.items():
        without = ARM.without_effect(first) if any(use.name == first for use in ARM.effects) else ARM
        assert not any(t.effect == name for t in listed(without)[0])
        beside = listed(without.with_effect(first, (2,)))[0]
        assert [t.joints for t in beside if t.effect == name] == [(2,)]
        assert [t.joints for t in listed(without, (name,))[0]] == [(1,), (2,), (3,)]
    assert [t.joints for t in listed(ARM, ("dead_zone",), (3,))[0]] == [(3,)]


def test_starts_are_within_bounds_differ_and_do_something(all_trials: list[Trial]) -> None:
    for trial in all_trials:
        assert trial.starts, trial.effect
        for k, start in enumerate(trial.starts):
            assert start not in trial.starts[:k], trial.effect
            assert any(start[name] != trial.null[name] for name in trial.amplitudes), trial.effect
            assert all(p.low <= start[p.name] <= p.high for p in trial.parameters), trial.effect


def test_an_effect_of_the_model_is_tried_by_lifting_its_prior() -> None:
    """Once: what an earlier step has freed is free already."""
    (own,), _, given = listed(ARM, ("viscous_friction",), (2,))
    name = "joint2.viscous_friction.coefficient"
    assert own.model.by_name.keys() == given.model.by_name.keys()
    assert [p.name for p in own.parameters] == [p.name for p in own.stated] == [name]
    assert own.origin == {name: ARM.parameter(name).value}
    case = case_of(ARM, [imagined.trace(ARM, seconds=1.0)], effects=("viscous_friction",))
    freed = case.unknowns(ARM, {name: ARM.parameter(name)})
    now = evaluate(case.compared, freed, {u.name: u.start for u in freed}, np.ones(3))
    assert {t.joints for t in list_trials(now, case.compared.observation, case.options)} == {(1,), (3,)}


def test_stiction_and_stribeck_friction_are_told_apart_by_speed(all_trials: list[Trial]) -> None:
    stribeck = [t for t in all_trials if t.joints == (3,) and "stribeck_friction" in (t.law, t.effect)]
    speeds = {t.effect: p for t in stribeck for p in t.parameters if p.part == "speed"}
    assert len(stribeck) == 2
    assert speeds["stiction"].high == speeds["stribeck_friction"].low == STICTION_SPEED


def test_what_no_one_knows_is_refused() -> None:
    with pytest.raises(SpecError, match="not in the library"):
        listed(ARM, ("gremlins",))
    with pytest.raises(SpecError, match="on joint 5: not modelled; modelled joints are"):
        listed(ARM, ("coulomb_friction", "dead_zone"), (5,))


def test_effects_of_the_users_own_are_tried_where_they_can_be() -> None:
    """On the joints of their file alone, and as long as a model has room for one more."""
    add_own(own_effect("grease", joints=(2,)))
    add_own(own_effect("large", parameters=at.USER_COLUMNS))
    try:
        assert [t.joints for t in listed(ARM, ("grease",))[0]] == [(2,)]
        found, observation, now = listed(ARM, ("large",))
        assert [t.joints for t in found] == [(1,), (2,), (3,)]
        full = replace(now, compared=now.compared.of_model(now.model.with_effect("grease", (2,))))
        assert list(list_trials(full, observation, reading_options(DiagnosisOptions(effects=("large",))))) == []
    finally:
        remove_own("grease")
        remove_own("large")


# ---- Starts that follow from the records.


@pytest.mark.parametrize(("volts", "below"), [(3.0, True), (100.0, False)])
def test_a_limit_is_tried_below_the_largest_recorded_drive(volts: float, below: bool) -> None:
    """The usual limits are of the supply."""
    (trial,), _, _ = listed(ARM, ("supply_limit",), (2,), volts)
    (name,) = trial.amplitudes
    usual = len(TIMES["supply_limit"])
    assert all(start[name] > 3.0 for start in trial.starts[:usual])
    assert [s[name] for s in trial.starts[usual:]] == [3.0 * share for share in SHARES_OF_LIMIT if below]


def test_a_cable_becomes_taut_where_the_joint_has_been_on_either_side() -> None:
    (trial,), observation, _ = listed(ARM, ("one_sided_spring",), (2,))
    positions = np.concatenate([r.inputs.readings[:, 1] for r in observation.records])
    rest = next(p for p in trial.parameters if p.part == "rest")
    assert np.nanmin(positions) <= rest.low < rest.high <= np.nanmax(positions)
    assert all(rest.low <= start[rest.name] <= rest.high for start in trial.starts)
    stiffness = {np.sign(start["joint2.one_sided_spring.stiffness"]) for start in trial.starts}
    assert stiffness == {-1.0, 1.0}
