"""What models and a diagnosis make of records of a bench of servos that hides an effect."""

from pathlib import Path

import pytest

from daq.contracts.machine import load_machine
from mock_controller.servos.bench import Options
from mock_controller.servos.secret import Secret, draw_secret
from model.discrepancy.options import DiagnosisOptions
from model.discrepancy.workflow import diagnose
from model.machine_model.model import Model, base_model
from tests.daq.runner.test_servo_models import left, motion
from tests.daq.servo_bench import PAN_TILT, recorded

LOADED = 4
"""A seed that hides a load of 0.082 kg at the bar's end."""


def known() -> Model:
    """The head after its servos have been measured."""
    return base_model(load_machine(str(PAN_TILT.with_name("pan_tilt_known.toml"))))


@pytest.mark.parametrize(
    ("secret", "name", "part"),
    [
        (draw_secret(LOADED), "payload", "mass"),
        (Secret("dead_zone", 2, 0.6), "dead_zone", "width"),
        (Secret("spring_torque", 1, 0.8), "spring_torque", "stiffness"),
    ],
)
def test_the_models_effect_of_that_name_and_size_explains_what_the_bench_hides(
    secret: Secret, name: str, part: str, tmp_path: Path
) -> None:
    trace = recorded(Options(torque=True, secret=secret), motion(1, 4.0), tmp_path)
    joints = () if name == "payload" else (secret.joint,)
    values = {part: secret.size}
    if name == "spring_torque":
        values["rest"] = float(trace.position[0, 0])
    model = known()
    explained = left(model.with_effect(name, joints, values), trace)
    without = left(model, trace)
    k = secret.joint - 1
    assert explained[k] < 0.5 * without[k]
    assert explained[k] < 1.0


@pytest.mark.slow
@pytest.mark.timeout(900)
def test_a_hidden_load_is_named_and_its_interval_holds_the_truth(tmp_path: Path) -> None:
    secret = draw_secret(LOADED)
    fit_to, held_out = (recorded(Options(torque=True, secret=secret), motion(seed, 5.0), tmp_path) for seed in (1, 2))
    effects = ("payload", "spring_torque", "dead_zone")
    found = diagnose(known(), [fit_to], [held_out], DiagnosisOptions(joints=(2,), effects=effects))
    assert found.verdict == "named"
    assert found.gap.stages[-1].effect == "payload"
    mass = found.model_after.parameter("load.payload.mass").value
    assert mass == pytest.approx(secret.size, rel=0.03)
