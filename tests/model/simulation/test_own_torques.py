"""Effects of the user's own as a run has them: a table of addresses, each of a torque that was checked first."""

import ctypes
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model.dynamics.dual import DUAL_STEP
from model.effects.effect_files import load_effect_file
from model.effects.library import own_effects, remove_own
from model.machine_model.model import Model, base_model
from model.simulation.own_table import own_table
from model.simulation.simulate import simulate
from tests.model.simulation.records import ramp_inputs

ARM = load_machine("ma2000")
BEYOND_COLUMNS = (0, 2)
"""Effect `pull` has two parameters, so those of the effect after it begin at the third column."""


@pytest.fixture(autouse=True)
def own_library() -> Iterator[None]:
    """Whatever a test loads is taken out again."""
    yield
    for name in own_effects():
        remove_own(name)


def loaded(folder: Path, name: str, arguments: str, torque: str, *parameters: str) -> None:
    """An effect file whose torque is one line."""
    stated = ", ".join(f'OwnParameter("{p}", unit="N·m", deviation=0.1)' for p in parameters)
    path = folder / f"{name}.py"
    path.write_text(
        "from model.effects.own import OwnEffect, OwnParameter\n"
        "from model.effects.own_math import magnitude\n\n\n"
        f"def torque({arguments}):\n    return {torque}\n\n\n"
        f'EFFECT = OwnEffect(name="{name}", physics="τ", source="a test", parameters=({stated},), torque=torque)\n'
    )
    load_effect_file(path)


def called(address: int, motion: list[Any], parameters: list[Any], dtype: type) -> Any:
    """The torque at an address, for position, speed, drive, load, time and the parameters."""
    arrays = [np.array(motion, dtype=dtype), np.array(parameters, dtype=dtype), np.zeros(1, dtype=dtype)]
    torque = ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * 3)(int(address))
    torque(*[array.ctypes.data for array in arrays])
    return arrays[2][0]


EVERY = "k * (position + 2 * speed + 3 * drive + 5 * load + 7 * time) + 11 * c * speed"


def test_a_torque_is_found_at_its_address_whatever_the_order_of_its_arguments(tmp_path: Path) -> None:
    loaded(tmp_path, "pull", "c, time, speed, k, load, drive, position", EVERY, "k", "c")
    model = base_model(ARM).with_effect("pull", (2,))
    real, dual = (own_table(model, dtype)[1, 0, 0] for dtype in (np.float64, np.complex128))
    motion, parameters = [0.1, 0.2, 0.4, 0.8, 1.6], [3.0, 0.5]
    value = 3.0 * (0.1 + 0.4 + 1.2 + 4.0 + 11.2) + 11 * 0.5 * 0.2
    assert called(real, motion, parameters, np.float64) == pytest.approx(value)
    seeded: list[Any] = [*motion]
    seeded[1] += 1j * DUAL_STEP
    found = called(dual, seeded, parameters, np.complex128)
    assert found.real == pytest.approx(value)
    assert found.imag / DUAL_STEP == pytest.approx(2 * 3.0 + 11 * 0.5)


def test_the_table_has_a_row_for_each_joint_and_a_column_for_each_effect(tmp_path: Path) -> None:
    loaded(tmp_path, "pull", "k, c", "k + c", "k", "c")
    loaded(tmp_path, "push", "speed, k", "k * speed", "k")
    model = base_model(ARM).with_effect("pull", (1, 3)).with_effect("push", (3,))
    table = own_table(model, np.float64)
    assert table.shape == (3, 2, 2)
    assert (table[:, :, 0] != 0).tolist() == [[True, False], [False, False], [True, True]]
    assert table[0, 0, 0] == table[2, 0, 0] != table[2, 1, 0]
    assert table[2, :, 1].tolist() == list(BEYOND_COLUMNS)
    assert own_table(base_model(ARM), np.float64).shape == (3, 0, 2)


def test_runs_in_dual_numbers_have_a_torque_of_their_own(tmp_path: Path) -> None:
    loaded(tmp_path, "pull", "k, speed", "k * speed", "k")
    model = base_model(ARM).with_effect("pull", (1,))
    assert own_table(model, np.float64)[0, 0, 0] != own_table(model, np.complex128)[0, 0, 0]
    assert own_table(model, np.float64)[0, 0, 0] == own_table(model, np.float64)[0, 0, 0], "it is compiled once"


def arm_with(folder: Path, arguments: str, torque: str) -> Callable[[], Model]:
    loaded(folder, "pull", arguments, torque, "k")
    return lambda: base_model(ARM).with_effect("pull", (1,))


@pytest.mark.parametrize(
    ("arguments", "torque", "says"),
    [
        ("k, speed", "-k * abs(speed) * speed", "derivative of its torque by speed is wrong"),
        ("k, drive", "k * (drive if drive.real > 0 else drive.real)", "torque by drive is wrong"),
        ("k, speed", "k if speed > 0 else -k", "pull: its torque cannot be compiled in dual numbers: "),
        ("k, speed", "k * speed.nothing", "pull: its torque cannot be compiled in real numbers: "),
        ("k", "k + 1.0", "pull: its torque is 1 N·m where its parameters are at null; it must be 0"),
        ("k, time", "k * time.imag * 1e30 + k * time", "its torque differs in real and in dual numbers"),
    ],
)
def test_a_torque_that_is_not_one_function_with_exact_derivatives_is_refused_in_one_line(
    tmp_path: Path, arguments: str, torque: str, says: str
) -> None:
    model = arm_with(tmp_path, arguments, torque)()
    with pytest.raises(SpecError, match=says) as raised:
        own_table(model, np.float64)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("torque", ["k * magnitude(speed) * speed", "k * magnitude(speed)"])
def test_a_torque_may_have_a_corner(tmp_path: Path, torque: str) -> None:
    assert own_table(arm_with(tmp_path, "k, speed", torque)(), np.float64)[0, 0, 0] != 0


def test_the_arm_with_a_gear_that_gives_moves_to_the_bit_as_the_general_steps_move_it(tmp_path: Path) -> None:
    """A user's effect takes the general steps. Of no size, it changes nothing else."""
    loaded(tmp_path, "pull", "k", "k", "k")
    inputs = ramp_inputs(ARM, back=True)
    model = (
        base_model(ARM)
        .with_effect("joint_compliance", (1,), {"compliance": 1e-3})
        .with_effect("backlash", (3,), {"gap": 0.02})
        .with_effect("stiction", (2,), {"breakaway": 0.6})
        .with_effect("gravity_torque_friction", (2,), {"share": 0.1})
        .with_effect("base_tilt", values={"about_x": 0.05})
    )
    own = simulate(model, inputs)
    general = simulate(model.with_effect("pull", (2,)), inputs)
    assert np.array_equal(own.position, general.position)
    assert np.array_equal(own.drive, general.drive)
