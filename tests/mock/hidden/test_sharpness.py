"""Which effects the records of an arm can tell from the hidden one, on an experiment short enough for a test."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from mock_controller import sharpness as command
from mock_controller.board import default_board
from mock_controller.hidden.arm import HiddenArm, HiddenEffect, Kind, Load, compose_seed, draw_arm
from mock_controller.hidden.descent import Problem, descend, differences
from mock_controller.hidden.experiment import Experiment, ExperimentError, read_experiment
from mock_controller.hidden.rivals import RivalError, places_of, rival_at
from mock_controller.hidden.separation import Tangents, tangents
from mock_controller.hidden.sharpness import NOT_TOLD, Comparison
from mock_controller.modifications.load import PeriodicDisturbance
from mock_controller.modifications.registry import known_modifications
from mock_controller.plant import default_plant
from tests.mock.hidden.test_separation import short

Floats = NDArray[np.float64]


@pytest.fixture(scope="module")
def known() -> Tangents:
    return tangents(default_plant(), default_board(), short())


def arm_with(effect: str, **values: float) -> HiddenArm:
    """An arm without deviations, with one effect at joint 1."""
    drawn = draw_arm(compose_seed(1, Kind.SINGLE, Load.NOMINAL))
    return replace(drawn, deviations={}, effects=(HiddenEffect(effect, (1,), ({"joint": 1, **values},), 0.5),))


def compared(known: Tangents, effect: str, **values: float) -> Comparison:
    return Comparison(arm_with(effect, **values), [short()], [known])


def test_two_laws_that_are_the_same_torque_in_this_motion_cannot_be_told_apart(known: Tangents) -> None:
    # Joint 1 is upright: the weights that press on its bearings change little, whatever the arm does.
    told = compared(known, "coulomb_friction", torque=6.0).rival("load_dependent_friction", (1,))
    assert told.d_prime < NOT_TOLD
    assert (told.effect, told.joints) == ("load_dependent_friction", (1,))


def test_a_law_of_another_shape_can_be_told_and_is_no_farther_than_the_sound_arm(known: Tangents) -> None:
    arm = compared(known, "coulomb_friction", torque=6.0)
    told = arm.rival("input_delay", (1,))
    assert 20.0 < told.d_prime < 1.1 * arm.rival("wrong_gain", (1,)).d_prime


def test_what_the_controller_s_own_numbers_show_and_what_the_mock_has_not_is_as_far_as_the_sound_arm(
    known: Tangents,
) -> None:
    arm = compared(known, "dead_zone", width=3.0)
    rivals = (("wrong_gain", (1,)), ("lost_set_points", (1,)), ("gear_loss", (5,)), ("centre_of_mass", (1,)))
    found = {arm.rival(*rival).d_prime for rival in rivals}
    assert len(found) == 1
    assert found.pop() > 5.0


def test_two_experiments_tell_more_than_one(known: Tangents) -> None:
    arm = arm_with("motor_inductance", inductance=0.03)
    once = Comparison(arm, [short()], [known]).rival("input_delay", (1,)).linear
    twice = Comparison(arm, [short(), short()], [known, known]).rival("input_delay", (1,)).linear
    assert once < twice < 1.5 * once


def test_rivals_are_those_of_an_arm_with_one_effect(known: Tangents) -> None:
    pair = draw_arm(compose_seed(1, Kind.PAIR, Load.NOMINAL))
    with pytest.raises(ValueError, match="hides 2 effects"):
        Comparison(pair, [short()], [known])


@pytest.mark.parametrize("effect", [name for name, kind in known_modifications().items() if kind.shared])
def test_every_effect_of_the_shared_list_can_be_a_rival_at_its_joints(effect: str) -> None:
    (place,) = places_of(effect, (2,))
    rival = rival_at(effect, place)
    assert rival is not None
    low, high = rival.reach
    for start in rival.starts():
        assert np.all((low <= start) & (start <= high))
        made = rival.modifications(np.clip(start, low, high))
        assert {change.name for change in made} <= {effect, "bent_curve"}
    assert rival.modifications(np.where(rival.sizes, 0.0, start)) == () or effect == "potentiometer_nonlinearity"


def test_a_tone_of_negative_size_is_one_of_the_opposite_phase() -> None:
    rival = rival_at("periodic_disturbance", (1,))
    assert rival is not None
    (there,), (opposite,) = (rival.modifications(np.array([size, 0.0, 0.5])) for size in (1.0, -1.0))
    assert isinstance(there, PeriodicDisturbance)
    assert isinstance(opposite, PeriodicDisturbance)
    assert there.amplitude == opposite.amplitude
    assert abs(there.phase - opposite.phase) == pytest.approx(math.pi)


def test_an_effect_of_the_whole_arm_has_rivals_at_every_joint_of_theirs() -> None:
    assert places_of("payload", (1,)) == [()]
    assert places_of("gear_loss", (2,)) == [(2,)]
    assert places_of("link_mass", ()) == [(2,), (3,)]


def test_a_search_finds_the_bottom_of_a_valley_from_poor_derivatives() -> None:
    def residual(at: Floats) -> Floats:
        return np.array([at[0] - 1.0, 10.0 * (at[1] - at[0] ** 2)])

    def slopes(at: Floats, left: Floats) -> Floats:
        return differences(residual, at, left, np.full(2, 3.0), 1e-6)

    problem = Problem(residual, slopes, np.full(2, -3.0), np.full(2, 3.0), 1e-8)
    place, left = descend(problem, np.array([-1.2, 1.0]), 200, 20, np.eye(2))
    assert place == pytest.approx([1.0, 1.0], abs=1e-3)
    assert left @ left < 1e-6


def test_differences_stay_within_their_bounds() -> None:
    def residual(at: Floats) -> Floats:
        assert at[0] <= 1.0
        return 3.0 * at

    at = np.array([1.0])
    assert differences(residual, at, residual(at), at, 0.1) == pytest.approx(np.array([[3.0]]))


def test_the_command_prints_the_nearest_place_of_each_rival(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = [list(row) for row in short().set_points]
    file = tmp_path / "experiment.json"
    file.write_text(json.dumps({"set_points": rows, "gains": [[2, 0, 0]] * 6}), "utf-8")
    assert read_experiment(file) == Experiment(short().set_points)
    monkeypatch.setattr(command, "draw_arm", lambda _seed: arm_with("coulomb_friction", torque=6.0))
    words = ["1020", "--experiment", str(file), "--cache", str(tmp_path)]
    rivals = ["--rival", "load_dependent_friction:1", "--rival", "input_delay:2", "--rival", "coulomb_friction:2"]
    assert command.main([*words, *rivals]) == 0
    first, second = json.loads(capsys.readouterr().out)["rivals"]
    assert (first["effect"], first["joints"]) == ("load_dependent_friction", [1])
    assert first["d_prime"] < 5.0
    assert (second["effect"], second["d_prime"] > 5.0) == ("input_delay", True)
    assert command.main([*words, "--rival", "tight_spot"]) == 2
    assert "is no effect of the shared list" in capsys.readouterr().err


def test_wrong_rivals_and_experiments_are_refused(tmp_path: Path) -> None:
    assert command.parse_rival("gear_loss:1,3") == ("gear_loss", (1, 3))
    assert command.parse_rival("payload:") == ("payload", ())
    with pytest.raises(RivalError, match="write NAME"):
        command.parse_rival("gear_loss:one")
    file = tmp_path / "experiment.json"
    file.write_text('{"set_points": []}', "utf-8")
    with pytest.raises(ExperimentError, match="no set points with gains"):
        read_experiment(file)
    with pytest.raises(ExperimentError, match="gains of 1 joints"):
        Experiment(short().set_points, joint_gains=((2, 0, 0),))
