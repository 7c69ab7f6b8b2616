"""Base parameters: the textbook's groupings, Pinocchio's regressor, published counts, and what records tell."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from daq.contracts.machine import load_machine
from model.arrays import Floats
from model.base_parameters.base_parameters import base_parameters, regressor
from model.base_parameters.grouping import grouped
from model.base_parameters.result import headline
from model.base_parameters.standard import (
    Motion,
    about_own_axis,
    inertial_regressor,
    joint_parameters,
    link_parameters,
    standard_values,
)
from model.dynamics import recursive
from model.fitting.options import FitOptions
from model.inverse_dynamics.fit import fit_torques
from model.kinematics.chain import Chain, Joint
from model.machine_model.model import base_model
from model.simulation.chain_of_model import chain_of
from tests.model.dynamics.chains import random_chain, random_link
from tests.model.inverse_dynamics.test_fit_torques import COULOMB, LENGTH, MASS, ROTOR, VISCOUS, rod, swinging

EXAMPLES = Path(__file__).parents[3] / "examples"


def some_motion(joints: int, count: int, seed: int = 5) -> Motion:
    rng = np.random.default_rng(seed)
    speed = rng.normal(size=(count, joints))
    return Motion(rng.uniform(-3, 3, (count, joints)), speed, rng.normal(size=(count, joints)) * 5, np.sign(speed))


@pytest.mark.parametrize("kinds", ["revolute", "mixed"])
def test_the_regressor_times_the_standard_parameters_is_the_torque(kinds: str) -> None:
    chain = random_chain(4, 4, kinds).arrays()
    chain = chain._replace(rotor_inertia=np.zeros(4))
    motion = some_motion(4, 20)
    parameters = np.concatenate([about_own_axis(chain, link) for link in range(4)])
    torque = np.array([recursive.inverse_dynamics(chain, *row) for row in zip(*motion_rows(motion), strict=True)])
    np.testing.assert_allclose(inertial_regressor(chain, motion) @ parameters, torque, rtol=0, atol=1e-10)


def motion_rows(motion: Motion) -> tuple[list[Floats], list[Floats], list[Floats]]:
    return list(motion.position), list(motion.speed), list(motion.acceleration)


def of_published_arm(twists: tuple[float, ...], lengths: tuple[float, ...], offsets: tuple[float, ...]) -> int:
    """The number of inertial base parameters of an arm of six joints that turn, on a level floor."""
    rng = np.random.default_rng(1)
    joints = tuple(Joint(alpha=t, a=a, d=d) for t, a, d in zip(twists, lengths, offsets, strict=True))
    chain = Chain(joints, tuple(random_link(rng) for _ in joints)).arrays()
    columns = inertial_regressor(chain, some_motion(len(joints), 200))
    return len(grouped(columns.reshape(-1, columns.shape[-1]), range(columns.shape[-1])).base)


def test_a_puma_560_has_36() -> None:
    """Mayeda, Yoshida and Osuka (1990, IEEE Trans. Robotics and Automation 6): 36 for the PUMA 560. Its lengths are
    those of Corke and Armstrong-Hélouvry (1994)."""
    right = np.pi / 2
    twists, lengths = (right, 0.0, -right, right, -right, 0.0), (0.0, 0.4318, 0.0203, 0.0, 0.0, 0.0)
    assert of_published_arm(twists, lengths, (0.0, 0.0, 0.15005, 0.4318, 0.0, 0.0)) == 36


def test_the_ma2000_is_grouped_as_the_textbook_groups_a_waist_with_two_parallel_axes() -> None:
    """Khalil and Dombre's rules for joints that turn: of a joint, YY, MZ and m go to the link before; of the first,
    whose axis is vertical, only the moment about it is left."""
    found = base_parameters(base_model(load_machine("ma2000")))
    texts = [p.text for p in found.parameters]
    assert texts[:9] == [
        "ZZ_1 + YY_2 + YY_3 + Ia_1 + a_2² m_3",
        "ZZ_2 + Ia_2 + a_2² m_3",
        "XX_2 − YY_2 − a_2² m_3",
        "XY_2",
        "XZ_2 − a_2 MZ_3",
        "YZ_2",
        "MX_2 + a_2 m_3",
        "MY_2",
        "ZZ_3",
    ]
    assert "Fv_1 + Ke_1" in texts
    assert (found.inertial, found.friction, found.standard) == (16, 6, 42)
    assert {"m_1", "XX_1", "m_2", "MZ_2"} <= set(found.without_effect)
    assert found.smallest_kept > 1e-3
    assert found.largest_dropped < 1e-12
    assert headline(found) == "base parameters: 22 of 42 (16 inertial, 6 friction)"


def test_base_parameters_alone_give_the_torque_of_the_whole_model() -> None:
    model = base_model(load_machine("ma2000"))
    chain, motion = chain_of(model), some_motion(3, 50)
    standards = (*link_parameters(3), *joint_parameters(model))
    columns = regressor(chain, standards, motion)
    places = {one.symbol: k for k, one in enumerate(standards)}
    found = base_parameters(model)
    base = [places[p.members[0].symbol] for p in found.parameters]
    np.testing.assert_allclose(
        columns[:, :, base] @ np.array([p.value for p in found.parameters]),
        columns @ standard_values(model, standards),
        atol=1e-9,
    )


def test_a_record_that_excites_all_tells_all_and_the_fitted_model_has_their_values() -> None:
    """The hand-written swing of the fits of torques: its numbers are known."""
    options = FitOptions(parameters=("link1.mass", "*friction*", "joint1.drive.inertia"), use_priors=False)
    fitted = fit_torques(rod(), [swinging(1)], [], options).model
    found = base_parameters(fitted, [swinging(1)])
    told = found.excitation
    assert (told.rank, told.told) == (5, 5)
    assert told.condition == pytest.approx(3.45, abs=0.02)
    truth = {
        "MX_1": MASS * LENGTH / 2,
        "ZZ_1": MASS * LENGTH**2 / 3 + ROTOR,
        "MY_1": 0.0,
        "Fv_1": VISCOUS,
        "Fc_1": COULOMB,
    }
    for parameter, recorded in zip(found.parameters, told.parameters, strict=True):
        own = truth[parameter.members[0].symbol]
        assert abs(parameter.value - own) < max(4 * recorded.deviation, 0.1 * own)


def test_a_motor_other_than_the_files_is_judged_as_one_that_the_file_states(tmp_path: Path) -> None:
    """The residual of a torque balance is told in the unit of the stated drive, base parameters are joint torques."""
    text, as_stated = (EXAMPLES / "single_axis.toml").read_text("utf-8"), 'gain = "0.5 N·m/V"'
    assert as_stated in text
    other = tmp_path / "single_axis.toml"
    other.write_text(text.replace(as_stated, 'gain = "0.7 N·m/V"'), "utf-8")
    names = [name for name in rod().by_name if name.endswith("drive.gain")]
    fitted = rod().with_values(dict.fromkeys(names, 0.7))
    found = base_parameters(fitted, [swinging(1)]).excitation
    stated = base_parameters(base_model(load_machine(str(other))), [swinging(1)]).excitation
    for one, same in zip(found.parameters, stated.parameters, strict=True):
        assert one.deviation == pytest.approx(same.deviation, rel=1e-6)
    assert found.residual == pytest.approx(stated.residual, rel=1e-6)
    as_file = base_parameters(rod(), [swinging(1)]).excitation
    assert found.residual != pytest.approx(as_file.residual, rel=0.1)


def test_a_record_of_one_joint_does_not_tell_the_others(tmp_path: Path) -> None:
    machine = load_machine(str(EXAMPLES / "pan_tilt.toml"))
    one = swinging(1)
    still, tilt = np.full(len(one), np.pi), one.position[:, 0] + 2.4
    assert one.drive is not None
    angles, drives = np.stack([still, tilt], axis=1), np.insert(one.drive, 0, 0.0, axis=1)
    two = replace(one, joints=(1, 2), position=angles, set_point=angles, velocity=None, drive=drives)
    told = base_parameters(base_model(machine), [two])
    verdicts = dict(zip((p.text for p in told.parameters), told.excitation.parameters, strict=True))
    assert not verdicts["Fc_1"].told
    assert told.excitation.told < len(told.parameters)


def test_a_trace_without_a_drive_leaves_the_machines_part_and_says_why() -> None:
    found = base_parameters(rod(), [swinging(1, torque=False)])
    assert found.excitation is None
    assert found.no_excitation is not None
    assert "drive" in found.no_excitation
    assert len(found.parameters) == 5
