"""Secret effects of the bench of servos: drawn from a seed, told by `reveal` alone, and at work in the plant."""

import json
import math

import pytest

from mock_controller.reveal import main as reveal
from mock_controller.servos.__main__ import main as start
from mock_controller.servos.plant import Head, Motor, PanTilt
from mock_controller.servos.secret import NONE, Secret, draw_secret

SMOOTH = Motor(coulomb=0.0)


def after(secret: Secret, volts: tuple[float, float], motor: Motor = SMOOTH, seconds: float = 0.5) -> PanTilt:
    """A head that begins level, after some time with voltages at its motors."""
    head = PanTilt(Head(), motor, secret=secret)
    head.volts = [*volts]
    for _ in range(round(seconds / 250e-6)):
        head.step()
    return head


def test_a_seed_hides_one_effect_and_reveal_tells_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert reveal(["--servos", "4", "5"]) == 0
    told = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [one["seed"] for one in told] == [4, 5]
    for one in told:
        secret, (effect,) = draw_secret(one["seed"]), one["effects"]
        assert (effect["effect"], effect["joint"], effect["size"]) == (secret.effect, secret.joint, secret.size)
    assert {draw_secret(seed).effect for seed in range(60)} == {
        "payload",
        "coulomb_friction",
        "viscous_friction",
        "direction_dependent_friction",
        "dead_zone",
        "spring_torque",
    }


def test_a_seed_without_a_meaning_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert reveal(["--servos", "-1"]) == 2
    assert start(["--secret", "-1"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert all("secret -1: a whole number from 0 on is allowed" in line for line in lines)


def test_a_load_makes_the_bar_fall_further_and_leaves_the_turntable_alone() -> None:
    sound, loaded = after(NONE, (0.0, 0.0)), after(Secret("payload", 2, 0.1), (0.0, 0.0))
    assert loaded.position[1] < 1.5 * sound.position[1] < 0.0
    assert loaded.position[0] == sound.position[0] == 0.0


@pytest.mark.parametrize("joint", [1, 2])
def test_each_effect_acts_on_its_own_joint_as_its_name_says(joint: int) -> None:
    k, volts = joint - 1, (3.0, 6.0)
    sound = after(NONE, volts)
    slowed = after(Secret("viscous_friction", joint, 0.5), volts)
    assert 0.0 < slowed.speed[k] < 0.8 * sound.speed[k]
    less = after(Secret("dead_zone", joint, 0.5), volts)
    stronger = after(NONE, tuple(v - 0.5 * (n == k) for n, v in enumerate(volts)))  # type: ignore[arg-type]
    assert less.position[k] == pytest.approx(stronger.position[k], rel=1e-12)
    held = after(Secret("spring_torque", joint, 1.0), volts)
    assert held.position[k] < 0.9 * sound.position[k]
    rubbing = after(Secret("coulomb_friction", joint, 0.3), volts)
    more = after(NONE, volts, Motor(coulomb=0.3))
    assert rubbing.position[k] == pytest.approx(more.position[k], rel=0.05)


def test_direction_dependent_friction_slows_forwards_and_helps_backwards() -> None:
    secret, motor = Secret("direction_dependent_friction", 1, 0.1), Motor(coulomb=0.1)
    forwards, backwards = (after(secret, (volts, 0.0), motor).position[0] for volts in (2.0, -2.0))
    sound = after(NONE, (2.0, 0.0), motor).position[0]
    assert forwards < sound < -backwards
    assert math.isclose(forwards - backwards, 2 * sound, rel_tol=0.01)
