"""What a seed hides, and that a mock built from it has just that."""

import csv
import json
import zipfile
from collections import Counter
from pathlib import Path

import pytest

from mock_controller import reveal
from mock_controller.board import default_board
from mock_controller.hidden.arm import LOAD_KG, HiddenArm, Kind, Load, SecretError, compose_seed, draw_arm
from mock_controller.hidden.sizes import LATER_SIZES, OPEN_SIZES, SHARED_SIZES, SizeRange, draw_values
from mock_controller.hidden.tolerances import tolerances
from mock_controller.modifications.registry import build_modification, is_shared, known_modifications
from mock_controller.plant import Plant, default_plant
from tests.mock.host import make_device

SIZES = SHARED_SIZES + LATER_SIZES + OPEN_SIZES
SHARED = {name for name in known_modifications() if is_shared(name)}
OPEN_SET = set(known_modifications()) - SHARED
CAME_LATER = {"quadratic_drag"}
"""Effects that came to the library after they had been drawn as none of it, and keep their draws."""


def arms(kind: Kind, count: int = 60) -> list[HiddenArm]:
    return [draw_arm(compose_seed(number, kind, Load.NOMINAL)) for number in range(count)]


def test_every_effect_and_every_arm_can_be_drawn() -> None:
    assert {size.effect for size in SHARED_SIZES + LATER_SIZES} == SHARED - CAME_LATER
    assert {size.effect for size in OPEN_SIZES} == OPEN_SET | CAME_LATER
    assert len(SIZES) == len({size.effect for size in SIZES})
    for kind in Kind:
        for load in Load:
            for number in range(12):
                arm = draw_arm(compose_seed(number, kind, load))
                parts = arm.parts(default_plant(), default_board())
                Plant(parts.plant, parts.modifications)


@pytest.mark.parametrize("size", SIZES, ids=lambda size: size.effect)
def test_sizes_from_end_to_end_are_allowed_and_can_be_built(size: SizeRange) -> None:
    from random import Random

    for joint in size.joints if size.acts_on_joints else (None,):
        amounts = []
        for strength in (0.0, 0.5, 1.0):
            for sign in (1, -1) if size.signed else (1,):
                values = draw_values(Random(strength), size, joint, strength, sign)
                effect = build_modification(size.effect, values)
                Plant(default_plant(), [effect], angles=default_plant().start)
                if sign == 1:
                    amounts.append(values[size.parameter])
        assert amounts == sorted(amounts)
        assert amounts[0] < amounts[-1]


def test_kinds_are_what_they_say() -> None:
    shared, unknown = SHARED, OPEN_SET | CAME_LATER
    assert all(arm.effects == () for arm in arms(Kind.CLEAN))
    assert all(len(arm.effects) == 1 and arm.effects[0].name in shared for arm in arms(Kind.SINGLE))
    assert all(len(arm.effects[0].joints) <= 1 for arm in arms(Kind.SINGLE))
    assert all(len(arm.effects) == 1 and arm.effects[0].name in unknown for arm in arms(Kind.OPEN_SET))
    for effect in (effect for arm in arms(Kind.OPEN_SET) for effect in arm.effects):
        assert (effect.known_as == "unknown_effect") != (effect.name in CAME_LATER)
    later = {size.effect for size in LATER_SIZES}
    assert {arm.effects[0].name for arm in arms(Kind.LATER_SINGLE)} == later
    assert not any(
        effect.name in later
        for kind in Kind
        if kind != Kind.LATER_SINGLE
        for arm in arms(kind)
        for effect in arm.effects
    )
    assert all(len({effect.name for effect in arm.effects}) == 2 for arm in arms(Kind.PAIR))
    assert all(len(arm.effects[0].joints) in (2, 3) for arm in arms(Kind.SHARED_BY_JOINTS))
    outside = [
        sum(abs(arm.deviations[tolerance.name]) > 2 * tolerance.drawn for tolerance in tolerances())
        for arm in arms(Kind.WRONG_PRIORS)
    ]
    assert set(outside) == {2}
    assert len(Counter(arm.kind for arm in arms(Kind.ANY, 100))) == 6


def test_singles_spread_and_shared_effects_have_one_strength_and_sign() -> None:
    drawn = [draw_arm(compose_seed(number, Kind.SINGLE, Load.NOMINAL)).effects[0] for number in range(600)]
    assert len({effect.name for effect in drawn}) == len(SHARED_SIZES)
    joints = Counter(effect.joints for effect in drawn)
    assert min(joints[(joint,)] for joint in (1, 2, 3)) > 120
    strengths = sorted(effect.strength for effect in drawn)
    assert strengths[150] == pytest.approx(0.25, abs=0.06)
    assert strengths[450] == pytest.approx(0.75, abs=0.06)
    for arm in arms(Kind.SHARED_BY_JOINTS):
        (effect,) = arm.effects
        assert [values["joint"] for values in effect.parameters] == list(effect.joints)
        if effect.name == "lost_set_points":
            assert len({values["seed"] for values in effect.parameters}) == 1


@pytest.mark.parametrize("load", list(Load))
def test_the_load_is_in_the_last_digit(load: Load) -> None:
    arm = draw_arm(compose_seed(12, Kind.CLEAN, load))
    nominal = LOAD_KG[load] or default_plant().rigid_body.m_load
    carried = arm.plant_parameters(default_plant()).rigid_body.m_load
    assert carried == pytest.approx(nominal * (1 + arm.deviations["m_load"]))


@pytest.mark.parametrize("seed", [-1, 80, 3, 189, 2**63])
def test_seeds_that_stand_for_no_arm_are_refused(seed: int, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SecretError, match="kinds 0 to 7, loads 0 to 2"):
        draw_arm(seed)
    if seed > 0:
        assert reveal.main([str(seed)]) == 2
        assert capsys.readouterr().err.startswith("mock_controller.reveal: secret ")


@pytest.mark.parametrize("kind", list(Kind))
def test_what_is_revealed_is_what_the_mock_was_built_with(kind: Kind, capsys: pytest.CaptureFixture[str]) -> None:
    seed = compose_seed(31, kind, Load.HEAVY)
    board = make_device(secret=seed).board
    assert reveal.main([str(seed)]) == 0
    truth = json.loads(capsys.readouterr().out)
    nominal, arm = default_plant(), board.plant.parameters
    effects = {effect["effect"]: effect for effect in truth["effects"]}
    built = [(change.name, vars(change)) for change in board.plant._modifications]
    revealed = [(name, values) for name, effect in effects.items() for values in effect["parameters"]]
    assert len(built) == len(revealed)
    for (name, state), (told_name, told) in zip(built, revealed, strict=True):
        assert name == told_name
        assert {key: state[key] for key in told} == told
    if not any(name.startswith(("payload", "link", "centre")) for name in effects):
        assert arm.rigid_body.m2 == nominal.rigid_body.m2 * (1 + truth["deviations"]["m2"])
        assert arm.rigid_body.m_load == truth["load_kg"] * (1 + truth["deviations"]["m_load"])
    resistance = nominal.joints[1].resistance * (1 + truth["deviations"]["resistance_2"])
    assert arm.joints[1].resistance == resistance


@pytest.mark.parametrize(("registration", "cases"), [("7", 622), ("8", 15)])
def test_the_arms_of_registered_trials_hide_what_they_hid(registration: str, cases: int) -> None:
    """Effects that came to the library later changed no draw; a magnet took the place of its back-EMF constant."""
    kept = Path(__file__).parents[3] / "docs" / "trial" / "registered.zip"
    with zipfile.ZipFile(kept) as archive:
        table = archive.read(f"registration-{registration}-diagnostic.csv").decode()
    rows = list(csv.DictReader(table.splitlines()))
    assert len(rows) == cases
    for row in rows:
        arm = draw_arm(int(row["seed"]))
        assert (arm.kind.name.lower(), arm.load.name.lower()) == (row["kind"], row["load"])
        hidden = row["hidden"].replace("back_emf_error", "weakened_magnet")
        assert " + ".join(effect.name for effect in arm.effects) == hidden
