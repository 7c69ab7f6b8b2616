"""Rigs of which only one of two records shows the effect well."""

from pathlib import Path

import pytest

from daq.contracts.machine import load_machine
from daq.traces.csv_table import import_csv
from model.discrepancy.diagnosis import Diagnosis
from model.discrepancy.inverse_dynamics.diagnose import diagnose_torques
from model.machine_model.model import base_model
from trials.rigs.folder import write_world


def diagnosed(folder: Path, kind: str, seed: int, case: str) -> Diagnosis:
    """The answer for a rig of another world."""
    write_world(folder, kind, seed, case)
    lab = folder / "lab"
    training, held_out = (import_csv(lab / f"{name}.csv") for name in ("training", "held_out"))
    return diagnose_torques(base_model(load_machine(str(lab / "machine.toml"))), [training], [held_out])


@pytest.mark.slow
def test_a_ripple_of_which_the_others_show_less_than_a_wave_keeps_its_name(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, "planar-current-via", 8874690243275, "single")
    assert [(s.effect, s.joints) for s in found.steps if s.adopted] == [("torque_ripple", (2,))], found.summary


@pytest.mark.slow
def test_a_drag_that_looks_viscous_in_one_motion_is_contradicted_by_another(tmp_path: Path) -> None:
    """Quadratic drag, which the library has no law for."""
    found = diagnosed(tmp_path, "axis-current-steps", 278342827514058, "open")
    assert found.verdict == "unknown-effect", found.summary
    assert not [s for s in found.steps if s.adopted]


@pytest.mark.slow
def test_friction_that_only_one_record_shows_beside_a_loss_is_taken_back(tmp_path: Path) -> None:
    """What a loss leaves where motion turns looks like Stribeck friction in steps, and not in a slow ramp."""
    found = diagnosed(tmp_path, "axis-current-steps", 54738089683743, "single")
    assert found.verdict == "named"
    assert [s.effect for s in found.steps if s.adopted] == ["gear_loss"], found.summary
