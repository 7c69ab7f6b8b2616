"""d′ of hidden effects, on an experiment short enough for a test."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mock_controller import detectability
from mock_controller.board import default_board
from mock_controller.hidden import separation as hidden_separation
from mock_controller.hidden.arm import Kind, Load, compose_seed, draw_arm
from mock_controller.hidden.experiment import (
    Experiment,
    ExperimentError,
    LoopParts,
    read_experiment,
    readings,
)
from mock_controller.hidden.separation import Tangents, separation, tangents
from mock_controller.hidden.tolerances import tolerances
from mock_controller.modifications import build_modifications
from mock_controller.plant import default_plant


def short() -> Experiment:
    """1.2 s: a quick ramp of joints 1 to 3 and back."""
    there = [(500 + 2 * k, 333 + 2 * k, 500 - 2 * k, 500, 500, 500) for k in range(15)]
    return Experiment((*there, *[there[-1]] * 15, *there[::-1], *[there[0]] * 15), settle=10)


SOUND = LoopParts(default_plant(), default_board(), (), 1)


@pytest.fixture(scope="module")
def known() -> Tangents:
    return tangents(default_plant(), default_board(), short())


def with_effect(name: str, **values: float) -> LoopParts:
    return replace(SOUND, modifications=build_modifications([(name, values)]))


def test_readings_repeat_and_tangents_are_those_of_every_tolerance_and_curve(known: Tangents) -> None:
    first, again = readings(SOUND, short()), readings(SOUND, short())
    assert first.shape == (60, 6)
    assert np.array_equal(first, again)
    assert first[-1, 0] == pytest.approx(500 * 4.096, abs=8)
    assert abs(first[25, 0] - 528 * 4.096) < 25
    assert known.names[: len(tolerances())] == tuple(tolerance.name for tolerance in tolerances())
    assert len(known.names) == len(tolerances()) + 3 * 3 * 2
    assert known.matrix.shape == (60 * 3, len(known.names))
    sizes = dict(zip(known.names, np.linalg.norm(known.matrix, axis=0), strict=True))
    assert sizes["back_emf_constant_2"] > 3
    assert sizes["m1"] < 1, "the source found it insensitive, too"


def test_the_loop_without_rounding_is_the_board_s_loop_but_for_rounding() -> None:
    from firmware_protocol.memory_map import default_memory_map
    from mock_controller.board import Board
    from mock_controller.plant import Plant

    experiment = short()
    plant = Plant(default_plant(), (), experiment.start_angles(default_board().calibrations))
    board = Board(default_board(), default_memory_map(), plant, 5, (), arm_seed=1)
    rows = [experiment.set_points[0]] * experiment.settle + list(experiment.set_points)
    seen = []
    for tick, row in enumerate(rows):
        board.run_until(tick * 20_000 + 10_000)  # what this period took is what was written in the one before
        snapshot = board.snapshots.newest()
        seen.append(snapshot.positions)
        if tick + 1 < len(rows):
            board.write_set_points(dict(enumerate(rows[tick + 1], start=1)))
        assert row
    difference = np.array(seen[experiment.settle :]) - readings(SOUND, experiment)
    assert np.abs(difference[:, :3]).max() < 5
    assert np.abs(difference[:, :3].mean(axis=0)).max() < 0.5


@pytest.mark.parametrize(
    ("name", "values", "deviations"),
    [
        ("weakened_magnet", {"joint": 3, "loss": 0.2}, math.sqrt(2) * 0.2 / 0.05),
        ("load_dependent_friction", {"joint": 3, "arm": 0.3}, 0.3 / 0.128486 * 3),
        ("payload", {"mass": 0.5}, 0.5 / 0.1250307),
    ],
)
def test_a_strong_effect_that_a_tolerance_can_imitate_costs_no_more_than_its_prior(
    name: str, values: dict[str, float], deviations: float, known: Tangents
) -> None:
    strong = with_effect(name, **values)
    once, settled = (separation(strong, short(), known, refits=refits) for refits in (0, 4))
    assert 0.5 * deviations < settled.d_prime <= 1.001 * deviations
    assert settled.d_prime < once.d_prime
    assert settled.before_refit == once.before_refit > 4 * settled.d_prime


def test_separation_grows_with_the_effect_and_is_looked_at_while_others_act(known: Tangents) -> None:
    found = [separation(with_effect("backlash", joint=1, play=play), short(), known) for play in (0.002, 0.02)]
    assert 0.5 < found[0].d_prime < found[1].d_prime
    assert found[1].d_prime > 10
    pair = build_modifications([("backlash", {"joint": 1, "play": 0.02}), ("wrong_gain", {"joint": 3, "factor": 1.3})])
    both = replace(SOUND, modifications=pair)
    first = separation(both, short(), known, without=pair[1:])
    alone = separation(replace(SOUND, modifications=pair[:1]), short(), known)
    assert first.d_prime == pytest.approx(alone.d_prime, rel=0.2)


def test_the_command_prints_a_line_an_arm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table = tmp_path / "experiment.csv"
    rows = [",".join(map(str, row)) for row in short().set_points[:20]]
    table.write_text("\n".join([",".join(f"set_point_{joint}" for joint in range(1, 7)), *rows]), "utf-8")
    clean, pair = compose_seed(4, Kind.CLEAN, Load.NOMINAL), compose_seed(4, Kind.PAIR, Load.NOMINAL)
    assert detectability.main([str(clean), str(pair), "--experiment", str(table)]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert lines[0] == {"seed": clean, "load_kg": None, "d_prime": 0.0, "effects": []}
    assert [effect["effect"] for effect in lines[1]["effects"]] == [effect.name for effect in draw_arm(pair).effects]
    assert lines[1]["d_prime"] >= 0.0
    assert detectability.main(["99", "--experiment", str(table)]) == 2
    assert detectability.main([str(clean), "--experiment", str(tmp_path / "missing.csv")]) == 2
    assert "missing.csv: No such file" in capsys.readouterr().err


def test_wrong_experiments_are_refused_in_one_line(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("set_point_1,set_point_2\n1,2\n", "utf-8")
    with pytest.raises(ExperimentError, match="no column set_point_3"):
        read_experiment(wrong)
    wrong.write_text(",".join(f"set_point_{k}" for k in range(1, 7)) + "\n1,2,3,4,5,6.5\n", "utf-8")
    with pytest.raises(ExperimentError, match="not whole posture units"):
        read_experiment(wrong)
    with pytest.raises(ExperimentError, match="at least 2"):
        Experiment(((500,) * 6,))
    with pytest.raises(ExperimentError, match="period 2"):
        Experiment(((500,) * 6, (500,) * 5 + (1000,)))


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("torque_ripple", {"joint": 1, "amplitude": 1.0, "periods": 30}),
        ("stiction", {"joint": 2, "breakaway": 6.0}),
        ("wrong_gain", {"joint": 3, "factor": 1.2}),
        ("joint_compliance", {"joint": 3, "compliance": 1.5e-3, "damping": 0.5}),
    ],
)
def test_looking_less_often_and_in_coarser_steps_gives_the_same(
    name: str, values: dict[str, float], known: Tangents, monkeypatch: pytest.MonkeyPatch
) -> None:
    parts = with_effect(name, **values)
    quick = separation(parts, short(), known)
    monkeypatch.setattr(hidden_separation, "_AS_PREDICTED", -1.0)
    monkeypatch.setattr(hidden_separation, "_CLEAR", math.inf)
    monkeypatch.setattr(hidden_separation, "step_length", lambda _parts: 1000)
    thorough = separation(parts, short(), known)
    assert quick.d_prime == pytest.approx(thorough.d_prime, rel=0.1 if quick.d_prime > 15 else 0.05)
