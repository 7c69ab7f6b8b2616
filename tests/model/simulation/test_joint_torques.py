"""Torques of a joint beside the rigid-body ones, and of a user's own effects, against integrals and closed forms."""

import ctypes
from collections.abc import Callable, Iterator
from functools import partial
from math import factorial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from daq.contracts.errors import SpecError
from daq.contracts.machine import load_machine
from model import layout as at
from model.arrays import Floats
from model.dynamics.dual import DUAL_STEP
from model.effects.library import load_effect_file, own_effects, remove_own
from model.machine_model.model import Model, base_model
from model.simulation import joint_torques, period
from model.simulation.own_table import own_table
from model.simulation.period import QUEUE
from model.simulation.simulate import simulate
from tests.model.simulation.records import ramp_inputs

# ---- Functions of compiled code are tried here as Python (`py_func`) where they call no other compiled one:
# the source is the same, and nothing has to be compiled


def plain(function: Any) -> Any:
    """The function as Python; it is that already where nothing is compiled."""
    return getattr(function, "py_func", function)


def joint(**columns: float) -> Floats:
    row = np.zeros(at.PER_JOINT)
    for name, value in columns.items():
        row[getattr(at, name)] = value
    return row


# ---- the winding


@pytest.mark.parametrize("x", [1e-9, 1e-3, 0.0499, 0.0501, 0.3, 2.0, 40.0])
def test_the_functions_of_a_winding_are_means_of_its_exponential(x: float) -> None:
    found = plain(joint_torques.winding_functions)(x)
    for power, value in enumerate(found):
        weight = partial(lambda n, s: np.exp(-x * s) * (1.0 - s) ** n / factorial(n), power)
        exact, _ = quad(weight, 0.0, 1.0, epsabs=1e-13)
        assert value == pytest.approx(exact, rel=1e-9)


WINDING = joint(RESISTANCE=1.5, INDUCTANCE=0.012, GEAR=50.0, TORQUE_CONSTANT=0.04, BACK_EMF=0.04)
WARM = 0.2


def currents(begun: float, ended: float, volts: float, start: float, h: float, count: int = 2) -> Floats:
    """L di/dt = u − R i − n K v(t) at so many moments of a step, with a speed that changes evenly; by an integrator of
    another make."""
    resistance = 1.5 * (1 + WARM)

    def rate(t: float, i: Floats) -> Floats:
        speed = begun + (ended - begun) * t / h
        return np.asarray((volts - resistance * i - 50.0 * 0.04 * speed) / 0.012)

    found = solve_ivp(
        rate, (0.0, h), [start], t_eval=np.linspace(0.0, h, count), rtol=1e-10, atol=1e-12, method="DOP853"
    )
    return np.asarray(found.y[0])


@pytest.mark.parametrize("h", [2e-4, 1e-3, 4e-3, 0.05])
def test_the_current_after_a_step_is_that_of_a_speed_that_changes_evenly(h: float) -> None:
    found = joint_torques.current_after(WINDING, WARM, 2.0, 12.0, 0.5, 0.9, h)
    assert found == pytest.approx(currents(0.5, 0.9, 12.0, 2.0, h)[-1], rel=1e-7)


def test_a_settled_current_is_what_the_back_emf_leaves_and_a_winding_that_warms_steps_of_its_own() -> None:
    assert joint_torques.steady_current(WINDING, WARM, 12.0, 0.5) == pytest.approx((12.0 - 0.04 * 50 * 0.5) / 1.8)
    weak = WINDING.copy()
    weak[at.FLUX_LOSS], weak[at.VISCOUS] = 0.1, 2e-4
    assert joint_torques.motor_gain(weak, WARM) == pytest.approx(50 * 0.036 / 1.8)
    assert joint_torques.motor_damping(weak, WARM) == pytest.approx(2500 * (0.036**2 / 1.8 + 2e-4))
    cold, warm = joint(), joint(HEATING=0.1)
    assert [plain(period.warms)(np.array(rows)) for rows in ([cold, cold], [cold, warm], [warm, cold])] == [
        False,
        True,
        True,
    ]


# ---- contacts


@pytest.mark.parametrize("shape", [0.0, 0.5, 1.0])
def test_friction_builds_up_over_the_presliding_distance(shape: float) -> None:
    """dz/dx = (1 − shape · sign(x) · z)/distance, and never beyond 1; far out the end may be a little nearer."""
    for begun in (-0.6, 0.0, 0.8):
        for moved in (-0.4, -0.01, 0.01, 0.4, 3.0):
            found = joint_torques.deflection(begun, moved, 1.0, shape)
            steps = np.linspace(0.0, moved, 20_001)
            z = begun
            for step in np.diff(steps[::100]):
                rate = 1.0 - shape * np.sign(moved) * z
                z = float(np.clip(z + step * (1.0 - shape * np.sign(moved) * (z + 0.5 * step * rate)), -1.0, 1.0))
            assert found == pytest.approx(z, abs=0.05 if abs(moved) > 0.5 else 3e-3)


def test_a_transmission_carries_nothing_inside_its_play_and_pulls_nothing_together() -> None:
    own = joint(GAP=0.02, COMPLIANCE=1e-3, CONTACT_COMPLIANCE=1e-3, TRANSMISSION_DAMPING=2.0)
    assert [joint_torques.transmitted(own, twist, 1.0) for twist in (-0.0099, 0.0, 0.01)] == [0.0, 0.0, 0.0]
    assert joint_torques.transmitted(own, 0.012, 0.5) == pytest.approx(0.002 / 2e-3 + 2.0 * 0.5)
    assert joint_torques.transmitted(own, -0.012, 0.25) == pytest.approx(-0.002 / 2e-3 + 2.0 * 0.25)
    assert joint_torques.transmitted(own, 0.012, -0.6) == 0.0, "damping would pull"


# ---- a control period


def changes(*extra: float, delay: float = 0.012) -> tuple[list[int], list[int], Floats]:
    """Whole periods of delay, order and times of the joints' changes of drive, for a period of 20 ms."""
    shared, joints = np.zeros(at.SHARED), np.array([joint(EXTRA_DELAY=each) for each in extra])
    shared[at.DELAY], shared[at.PERIOD] = delay, 0.02
    order, times = np.zeros(len(extra), dtype=np.int64), np.zeros(len(extra))
    periods = plain(period.switching_times)(shared, joints, order, times)
    return periods.tolist(), order.tolist(), times


def test_drives_change_in_the_order_of_their_delays_within_a_period() -> None:
    periods, order, times = changes(0.005, 0.0, 0.013)
    assert (periods, order) == ([0, 0, 1], [2, 1, 0])
    np.testing.assert_allclose(times, [0.017, 0.012, 0.005])
    assert changes(0.001, 0.001, 0.0, 0.001)[1] == [2, 0, 1, 3]
    assert changes(0.0, 0.0, 0.0)[1] == [0, 1, 2]
    periods, _, times = changes(0.0, 0.02, 0.06, delay=0.0)
    assert periods == [0, 1, 3]
    np.testing.assert_allclose(times, 0.0, atol=1e-15)
    periods, _, times = changes(0.279, 0.281, 0.5, -0.005, delay=0.0)
    assert periods == [13, 14, 14, 0]
    np.testing.assert_allclose(times, [0.019, 0.001, 0.22, -0.005], atol=1e-12)
    assert QUEUE == 16


@pytest.mark.parametrize(
    ("duration", "step", "count"),
    [(0.02, 1e-3, 20), (0.0201, 1e-3, 21), (1e-9, 1e-3, 1), (1e-3, 1e-3, 1), (0.1 * 3, 0.1, 3), (0.02, 0.5, 1)],
)
def test_a_stretch_has_as_few_equal_steps_as_its_longest_allows(duration: float, step: float, count: int) -> None:
    assert plain(period.step_count)(duration, step) == count


@pytest.mark.parametrize("column", period.EXTRA_TORQUES)
def test_every_torque_that_is_added_is_one_that_the_run_computes(column: int) -> None:
    joints = np.zeros((2, at.PER_JOINT))
    joints[1, column] = -0.1
    flags = np.array([at.HAS_STICTION, at.HAS_INDUCTANCE])
    found = plain(period.extra_flags)(joints, flags)
    assert found.tolist() == [at.HAS_STICTION, at.HAS_INDUCTANCE | at.HAS_EXTRA_TORQUE]
    assert flags.tolist() == [at.HAS_STICTION, at.HAS_INDUCTANCE]


# ---- Effects of the user's own as a run has them

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
