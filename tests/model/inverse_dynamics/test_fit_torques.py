"""Fits of recorded torques: on a motion whose torque is worked out here by hand, and on a real double pendulum."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.errors import SpecError, TraceError
from daq.contracts.machine import load_machine
from daq.contracts.trace import Trace
from daq.traces.csv_table import import_csv
from model.arrays import Floats
from model.effects.library import library
from model.fitting.options import FitOptions
from model.inverse_dynamics.fit import fit_torques, torque_curves
from model.inverse_dynamics.torque_balance import NOT_IN_TORQUES
from model.machine_model.model import Model, base_model
from model.reports.page import write_report
from model.reports.torque_report import torque_report
from tests.model.imported import imported

EXAMPLES = Path(__file__).parents[3] / "examples"
LENGTH, MASS, ROTOR, VISCOUS, COULOMB = 0.3, 0.93, 0.0043, 0.03, 0.05


Law = Callable[[Floats, Floats, Floats], Floats]


def swinging(seed: int, *, torque: bool = True, law: Law | None = None) -> Trace:
    """A hanging rod driven along a sum of sines: τ = (mL²/3 + J) q̈ + mgL/2 sin q + b q̇ + T sign q̇, written out.

    law: the torque of the motor for that torque, angle and speed, where there is another law beside these.
    """
    time = 0.004 * np.arange(2500)
    angle, speed, acceleration = (np.zeros_like(time) for _ in range(3))
    for k, rate in enumerate((2.1, 3.7, 6.0)):
        phase = seed + k
        angle += 0.4 * np.sin(rate * time + phase)
        speed += 0.4 * rate * np.cos(rate * time + phase)
        acceleration -= 0.4 * rate**2 * np.sin(rate * time + phase)
    needed = (MASS * LENGTH**2 / 3 + ROTOR) * acceleration + MASS * 9.81 * LENGTH / 2 * np.sin(angle)
    needed += VISCOUS * speed + COULOMB * np.sign(speed)
    if law is not None:
        needed = law(needed, angle, speed)
    drive = np.interp(time + 0.003, time, needed) / 0.5  # it acts after 1 ms and is held for 4 ms
    record = imported(f"swing{seed}", period=0.004, drive_unit="V")
    return Trace(
        record,
        (1,),
        time,
        angle[:, None],
        set_point=angle[:, None],
        velocity=speed[:, None],
        drive=drive[:, None] if torque else None,
    )


def rod() -> Model:
    return base_model(load_machine(str(EXAMPLES / "single_axis.toml")))


OPTIONS = FitOptions(
    parameters=("link1.mass", "joint1.viscous_friction.*", "joint1.coulomb_friction.*", "joint1.drive.inertia"),
    use_priors=False,
)


def test_the_parameters_of_the_motion_are_found_in_newton_metres() -> None:
    found = fit_torques(rod(), [swinging(1)], [swinging(5)], OPTIONS)
    assert found.model.parameter("link1.mass").value == pytest.approx(MASS, rel=0.01)
    assert found.model.parameter("joint1.viscous_friction.coefficient").value == pytest.approx(VISCOUS, rel=0.05)
    assert found.model.parameter("joint1.coulomb_friction.torque").value == pytest.approx(COULOMB, rel=0.1)
    assert found.held_out < 0.002
    assert "link1.mass" in found.identifiability.known
    # The rig's drive gives half a newton metre a volt
    found = fit_torques(rod(), [swinging(1)], [], OPTIONS)
    drive = swinging(1).drive
    assert drive is not None
    assert found.errors[0].torque[0] == pytest.approx(0.5 * float(np.sqrt((drive**2).mean())), rel=0.1)
    model = rod().without_effect("viscous_friction").without_effect("coulomb_friction")
    options = FitOptions(parameters=("link1.mass",), use_priors=False)
    assert fit_torques(model, [swinging(1)], [], options).in_sample > 0.05
    with pytest.raises(TraceError, match="no recorded drive"):
        fit_torques(rod(), [swinging(1, torque=False)], [], OPTIONS)


def test_what_is_known_has_an_interval_and_the_report_shows_it(tmp_path: Path) -> None:
    found = fit_torques(rod(), [swinging(1)], [swinging(5)], OPTIONS)
    by_name = {p.name: p for p in found.parameters}
    assert set(by_name) == {p.name for p in found.identifiability.parameters}
    for name, p in by_name.items():
        assert (p.value is None) == (p.verdict != "known"), name
        if p.value is not None:
            assert p.low <= p.value <= p.high
            assert p.high - p.low < 0.2 * abs(p.value), name
    curves = [torque_curves(found.model, t, found.cutoff) for t in (swinging(1), swinging(5))]
    np.testing.assert_allclose(np.sqrt((curves[1].left ** 2).mean(axis=0)), found.errors[1].rms)
    page = write_report(torque_report(found, curves), tmp_path / "torques.html").read_text("utf-8")
    assert "link1.mass" in page
    assert page.count("<svg") == 2
    assert "swing5" in page


@pytest.mark.parametrize("held", [False, True], ids=["fitted to", "held out"])
def test_a_drive_that_is_0_throughout_is_refused_before_the_search(held: bool) -> None:
    good, still = swinging(1), swinging(5)
    still = replace(still, drive=np.zeros_like(still.drive))
    said: list[str] = []
    with pytest.raises(TraceError, match="trace swing5: its drive is 0 throughout"):
        fit_torques(
            rod(),
            [good] if held else [good, still],
            [still] if held else [],
            OPTIONS,
            progress=lambda _, text: said.append(text),
        )
    assert said == ["low-passing the records"]


@pytest.mark.parametrize("name", sorted(NOT_IN_TORQUES))
def test_effects_that_torques_cannot_show_are_refused_by_name(name: str) -> None:
    with pytest.raises(SpecError, match=f"effect {name}: cannot be fitted to torques: .*; leave it out"):
        fit_torques(rod().with_effect(name, (1,)), [swinging(1)], [], OPTIONS)


OF_A_MOTOR = {"supply_limit"}
"""The rod's drive is a plain gain: it has no limit."""


@pytest.mark.parametrize("name", sorted(set(library()) - set(NOT_IN_TORQUES) - OF_A_MOTOR))
def test_every_other_effect_changes_the_torque_that_is_needed(name: str) -> None:
    """At thrice its expected size, on the motion of the rod."""
    model = rod()
    if any(use.name == name for use in model.effects):
        model = model.without_effect(name)
    wider = model.with_effect(name, () if library()[name].whole_machine else (1,))
    size = {
        p.name: p.null - p.deviation if p.name.endswith("voltage") else p.null + 3 * p.deviation
        for p in wider.parameters
        if p.effect == name and p.null is not None and p.deviation is not None
    }
    changed = wider.with_values(
        {n: float(np.clip(v, wider.parameter(n).low, wider.parameter(n).high)) for n, v in size.items()}
    )
    before, after = (torque_curves(m, swinging(1)).left for m in (wider, changed))
    assert np.abs(after - before).max() > 1e-6


@pytest.mark.slow
@pytest.mark.lab_data
@pytest.mark.timeout(600)
def test_a_real_double_pendulum(lab_data: Path) -> None:
    """Ten records of a real arm, four to fit and six held out. Least squares on base parameters, worked out outside
    this project, leaves 68 % of the torque without friction, 49 % with viscous and Coulomb friction and an offset."""
    folder = lab_data / "double_pendulum"
    if not folder.is_dir():
        pytest.skip(f"needs {folder}")
    runs = [import_csv(folder / f"run_{k:02d}.csv") for k in range(1, 11)]
    plain = base_model(load_machine(str(EXAMPLES / "double_pendulum.toml")))
    options = FitOptions(tolerance=1e-4)
    left = {}
    for name, effects in (
        ("none", ()),
        ("friction", ("viscous_friction", "coulomb_friction")),
        ("gear", ("viscous_friction", "coulomb_friction", "gear_loss")),
    ):
        model = plain
        for effect in effects:
            model = model.with_effect(effect, (1, 2))
        left[name] = fit_torques(model, runs[:4], runs[4:], options).held_out
    assert left["none"] == pytest.approx(0.679, abs=0.02)
    assert left["friction"] == pytest.approx(0.454, abs=0.02)
    assert left["gear"] == pytest.approx(0.45, abs=0.02)


LAWS: dict[str, tuple[str, float, Law]] = {
    "gravity_torque_friction": (
        "share",
        0.2,
        lambda t, q, v: t + 0.2 * np.abs(MASS * 9.81 * LENGTH / 2 * np.sin(q)) * np.sign(v),
    ),
    "direction_dependent_viscous_friction": ("difference", -0.02, lambda t, _q, v: t + 0.02 * np.minimum(v, 0.0)),
    "constant_torque": ("torque", 0.3, lambda t, _q, _v: t - 0.3),
    "one_sided_spring": ("stiffness", -0.6, lambda t, q, _v: t + 0.6 * np.minimum(q, 0.0)),
    "direction_dependent_gear_loss": ("difference", 0.15, lambda t, _q, v: np.where(t * v > 0, t / 0.85, t)),
}
"""By effect: its parameter, the value here, and the law written out."""


@pytest.mark.parametrize("effect", LAWS)
def test_a_law_of_friction_is_found_at_its_size(effect: str) -> None:
    part, value, law = LAWS[effect]
    name, others = f"joint1.{effect}.{part}", OPTIONS.parameters or ()
    records = [swinging(1, law=law)], [swinging(5, law=law)]
    found = fit_torques(
        rod().with_effect(effect, (1,)), *records, FitOptions(parameters=(name, *others), use_priors=False)
    )
    assert found.model.parameter(name).value == pytest.approx(value, rel=0.05)
    without = fit_torques(rod(), *records, OPTIONS)
    assert found.held_out < 0.2 * without.held_out
