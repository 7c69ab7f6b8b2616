"""Folders of worlds: the same for a seed, imported by the product, and of no code of the product's."""

import ast
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest

import trials.rigs
from daq.contracts.machine import load_machine, parse_machine
from daq.traces.csv_table import import_csv
from model.dynamics import recursive
from model.machine_model.model import base_model
from model.simulation.chain_of_model import chain_of
from trials import judge
from trials.judge import score
from trials.rigs.bodies import mjcf
from trials.rigs.drawing import sound_rig
from trials.rigs.folder import write_rig
from trials.rigs.hiding import IN_NO_LIBRARY, effects_of, hide, joints_of, known, tilted
from trials.rigs.kinds import KINDS, REPORTED, REPORTING, TUNING
from trials.rigs.lab import machine_text
from trials.rigs.recorded_rig import hidden_rig, make_rig

OURS = Path(trials.rigs.__file__).parent
FORBIDDEN = {"model", "daq", "daq_cli", "server", "mock_controller", "firmware_protocol", "benchmarks", "tests"}


def imports(path: Path) -> set[str]:
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module or "")
    return found


def test_rigs_import_nothing_of_the_product() -> None:
    files = list(OURS.glob("*.py"))
    assert len(files) > 8
    for path in files:
        names = imports(path)
        used = {name.partition(".")[0] for name in names}
        assert all(name.startswith("trials.rigs") for name in names if name.startswith("trials")), path
        assert not used & FORBIDDEN, path


@pytest.mark.parametrize("kind", ["planar-pid", "planar-torques", "arm-rounded", "six-volts"])
def test_the_file_stated_exactly_is_the_arm(kind: str) -> None:
    """Accelerations of the worlds' bodies under random torques, and what the model of the file needs for them."""
    rig = replace(sound_rig(kind, KINDS[kind], 2), tolerances=())
    chain = chain_of(base_model(parse_machine(machine_text(rig))))
    rotors = tuple(float(rotor) for rotor in rig.joints["rotor"])
    model = mujoco.MjModel.from_xml_string(mjcf(rig.bodies, rotors))
    data = mujoco.MjData(model)
    draw = np.random.default_rng(1)
    for _ in range(5):
        data.qpos[:], data.qvel[:] = draw.uniform(-1, 1, (2, rig.kind.joints))
        torques = draw.uniform(-1, 1, rig.kind.joints)
        data.qfrc_applied[:] = torques
        mujoco.mj_forward(model, data)
        needed = recursive.inverse_dynamics(chain, np.array(data.qpos), np.array(data.qvel), np.array(data.qacc))
        assert needed == pytest.approx(torques, abs=1e-5)


def test_no_kind_is_for_tuning_and_for_reports() -> None:
    assert len(TUNING) + len(REPORTED) + len(REPORTING) == len(KINDS) >= 10


def test_a_seed_gives_the_same_folder_to_the_bit(tmp_path: Path) -> None:
    first, again = (write_rig(tmp_path / name, "planar-board", 4) for name in ("first", "again"))
    assert [path.read_bytes() for path in first] == [path.read_bytes() for path in again]
    other = write_rig(tmp_path / "other", "planar-board", 6)
    assert [p.read_bytes() for p in other if p.suffix == ".csv"] != [
        p.read_bytes() for p in first if p.suffix == ".csv"
    ]


@pytest.mark.parametrize(
    "kind",
    [
        "axis-rounded",
        "planar-torques",
        *(pytest.param(kind, marks=pytest.mark.slow) for kind in ("planar-board", "arm-rounded")),
    ],
)
def test_the_product_reads_what_a_lab_has(tmp_path: Path, kind: str) -> None:
    write_rig(tmp_path, kind, 2)
    machine = load_machine(str(tmp_path / "lab" / "machine.toml"))
    assert len(machine.joints) == KINDS[kind].joints
    assert (machine.controller.kind != "none") == KINDS[kind].known_loop
    for name in ("training", "held_out"):
        trace = import_csv(tmp_path / "lab" / f"{name}.csv")
        assert trace.joints == machine.modelled_joints
        assert np.isfinite(trace.position).all()


@pytest.mark.parametrize("kind", list(KINDS))
def test_what_a_lab_has_tells_no_truth(tmp_path: Path, kind: str) -> None:
    """Only the machine file's text is looked at here, which is the same whatever is hidden; no record of any kind."""
    rig = sound_rig(kind, KINDS[kind], 1)
    texts = {machine_text(rig)}
    for name in effects_of(rig):
        size = {"load": 0.1, "about_x": 0.1, "about_y": 0.1, "mass": 0.1, "shift": 0.1}
        if name in ("payload", "base_tilt", "link_mass", "centre_of_mass"):
            texts.add(machine_text(hide(rig, name, joints_of(rig, name)[0], 0, size)))
    assert len(texts) == 1


def test_stated_numbers_are_off_by_as_much_as_their_deviations_say() -> None:
    off = []
    for seed in range(60):
        rig = sound_rig("planar-pid", KINDS["planar-pid"], seed)
        off += [(t.factor - 1.0) / t.share for t in rig.tolerances]
    assert np.std(off) == pytest.approx(0.93, abs=0.06)
    assert np.mean(off) == pytest.approx(0.0, abs=0.1)


@pytest.mark.parametrize("kind", list(TUNING))
def test_sound_arms_follow_their_set_points(kind: str) -> None:
    for motion in make_rig(kind, 1, "sound").records.values():
        assert np.isfinite(motion.position).all()
        assert np.abs(motion.set_point - motion.angle).max() < 1.0


@pytest.mark.slow
def test_every_effect_in_each_of_its_laws_leaves_a_loop_that_runs() -> None:
    for effect in effects_of(sound_rig("axis-pid", KINDS["axis-pid"], 5)):
        rig = hidden_rig("axis-pid", 5, effect=effect)
        assert [hidden.name for hidden in rig.hidden] == [effect]
        assert rig.hidden[0].in_library == (effect not in IN_NO_LIBRARY)


def test_a_base_that_turns_about_x_leans_its_weight_to_y() -> None:
    assert tilted((0.0, 0.0, -9.81), 0.1, 0.0) == pytest.approx((0.0, -9.81 * np.sin(0.1), -9.81 * np.cos(0.1)))
    assert np.linalg.norm(tilted((0.0, 0.0, -9.81), 0.1, 0.2)) == pytest.approx(9.81)


def test_the_truth_lies_outside_of_what_the_diagnosis_gets(tmp_path: Path) -> None:
    write_rig(tmp_path, "axis-pid", 1)
    truth = json.loads((tmp_path / "truth.json").read_text("utf-8"))
    assert truth["case"] == "single"
    assert len(truth["hidden"]) == 1
    assert sorted(path.name for path in (tmp_path / "lab").iterdir()) == [
        *("held_out.csv", "held_out.toml", "machine.toml", "training.csv", "training.toml")
    ]


def answered(verdict: str, *steps: tuple[str, list[int], list[str]]) -> dict[str, object]:
    made = [
        {"adopted": True, "effect": e, "joints": j, "group": [{"effect": g} for g in group]} for e, j, group in steps
    ]
    return {"verdict": verdict, "steps": made}


def truth(case: str, *hidden: tuple[str, int], sharp: dict[str, float] | None = None) -> dict[str, Any]:
    made: list[dict[str, Any]] = [{"name": n, "joint": j} for n, j in hidden]
    rivals = [{"name": n, "d_prime": d} for n, d in (sharp or {}).items()]
    return {"case": case, "hidden": made, **({"sharpness": rivals} if sharp else {})}


def test_a_name_is_strict_only_without_another() -> None:
    told = truth("single", ("coulomb_friction", 2))
    assert score(told, answered("named", ("coulomb_friction", [2], []))).strict
    both = answered("named", ("coulomb_friction", [2], []), ("backlash", [2], []))
    assert not score(told, both).strict
    assert score(told, both).answered
    assert score(told, answered("named", ("coulomb_friction", [1], []))).joints is False
    assert not score(told, None).strict


def test_a_gear_loss_of_one_direction_may_be_told_with_its_difference() -> None:
    lost = truth("single", ("gear_loss", 2))
    lost["hidden"][0] |= {"known_as": "gear_loss", "beside": list(known("gear_loss", 2)[1])}
    by_direction = ("direction_dependent_gear_loss", [2], [])
    assert score(lost, answered("named", ("gear_loss", [2], []), by_direction)).strict
    assert not score(lost, answered("named", by_direction)).strict
    pair = lost | {"case": "pair", "hidden": [*truth("single", ("payload", None))["hidden"], *lost["hidden"]]}
    both = ("payload", [], []), ("gear_loss", [2], [])
    assert score(pair, answered("named", *both, by_direction)).both
    assert not score(pair, answered("named", *both, ("backlash", [2], []))).both


def test_a_group_is_right_where_the_record_cannot_tell_its_members_apart() -> None:
    group = answered("ambiguous", ("backlash", [1], ["joint_compliance"]))
    untold = {"none": 80.0, "own": 0.0, "joint_compliance": 2.0, "dead_zone": 70.0}
    assert score(truth("single", ("backlash", 1), sharp=untold), group).sharp
    assert score(truth("single", ("backlash", 1), sharp=untold | {"joint_compliance": 9.0}), group).sharp is False
    assert score(truth("single", ("backlash", 1), sharp=untold | {"none": 3.0}), group).sharp is None


def test_an_answer_about_a_sound_arm_is_a_false_alarm() -> None:
    assert score(truth("sound"), answered("unknown-effect")).alarm
    assert score(truth("sound"), answered("nothing-significant")).alarm is False


@pytest.mark.parametrize(
    ("joint", "law", "name"),
    [(2, 0, "coulomb_friction"), (4, 0, "load_dependent_friction"), (2, 1, "gravity_torque_friction")],
)
def test_a_weight_that_presses_evenly_rubs_as_coulomb_friction(joint: int, law: int, name: str) -> None:
    rig = sound_rig("six-torques", KINDS["six-torques"], 1)
    (hidden,) = hide(rig, "load_dependent_friction", joint, law, {"load_share": 0.1}).hidden
    assert (hidden.name, hidden.known_as) == ("load_dependent_friction", name)


def test_an_unknown_kind_is_told_the_nearest(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["judge", "--kinds", "planar-tork"])
    with pytest.raises(SystemExit):
        judge.main()
    assert "planar-tork: there is none of that name; the nearest are planar-torques, " in capsys.readouterr().err
