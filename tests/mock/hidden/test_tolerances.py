"""What a seed draws: tolerances of healthy arms, memory maps, sensors; and that a secret is told to nobody."""

import json
import math
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from daq.contracts.machine import DcMotor, Machine, load_machine
from firmware_protocol.commands import Hello
from firmware_protocol.memory_map import default_memory_map
from mock_controller.board import default_board
from mock_controller.board.sensor import LinearityCurve
from mock_controller.control import Control
from mock_controller.hidden.arm import Kind, Load, compose_seed, draw_arm
from mock_controller.hidden.memory import Documented, draw_memory
from mock_controller.hidden.sensors import RANGE_DEVIATION, TURNED, draw_sensors, truth_of
from mock_controller.hidden.tolerances import (
    HARMONICS,
    deviating_board,
    deviating_plant,
    draw_deviations,
    harmonic_deviation,
    tolerances,
)
from mock_controller.modifications.registry import known_modifications
from mock_controller.options import OptionsError, read_options
from mock_controller.plant import default_plant
from tests.mock.host import LockStepHost, make_device
from tests.mock.process.running import RunningMock
from tests.mock.process.test_control import RecordedProcess


def stated_by(machine: Machine) -> dict[str, float]:
    """Deviations that the machine file states, as fractions of its values (delay: s)."""
    found = {}

    def take(name: str, quantity: object, relative: bool = True) -> None:
        deviation, value = getattr(quantity, "deviation", None), getattr(quantity, "value", 0.0)
        if deviation is not None:
            found[name] = deviation / value if relative else deviation

    take("m_load", machine.load)
    take("computing_delay", machine.controller.delay, relative=False)  # type: ignore[union-attr]
    for number, joint in enumerate(machine.joints[:3], start=1):
        take(f"m{number}", joint.link.mass)
        take("r1" if number == 1 else f"a{number}", joint.link.radius if number == 1 else joint.geometry.a)  # type: ignore[union-attr]
        assert isinstance(joint.drive, DcMotor)
        for key in ("resistance", "torque_constant", "back_emf_constant", "rotor_inertia"):
            take(f"{key}_{number}", getattr(joint.drive, key))
        take(f"viscous_friction_{number}", joint.friction.viscous_motor_side)
        take(f"coulomb_arm_{number}", joint.friction.coulomb_arm)
    return found


def test_arms_are_drawn_within_what_the_machine_file_states() -> None:
    ours = {tolerance.name: tolerance.stated for tolerance in tolerances()}
    assert ours == pytest.approx(stated_by(load_machine("ma2000")), rel=0.06)
    assert all(0 < tolerance.drawn <= tolerance.stated for tolerance in tolerances())
    draws = [draw_deviations(Random(seed)) for seed in range(400)]
    for tolerance in tolerances():
        values = np.array([draw[tolerance.name] for draw in draws])
        assert np.abs(values).max() <= 2 * tolerance.drawn
        # A normal deviate within two standard deviations has one of 0.88.
        assert values.std() == pytest.approx(0.88 * tolerance.drawn, rel=0.15)
        assert abs(values.mean()) < 0.2 * tolerance.drawn
    nothing = dict.fromkeys((tolerance.name for tolerance in tolerances()), 0.0)
    assert deviating_plant(default_plant(), nothing) == default_plant()
    assert deviating_board(default_board(), nothing) == default_board()
    assert draw_deviations(Random(1), scale=0.0) == nothing


@pytest.mark.parametrize("tolerance", tolerances(), ids=lambda tolerance: tolerance.name)
def test_every_deviation_moves_the_constant_it_is_named_after(tolerance: object) -> None:
    name = tolerance.name  # type: ignore[attr-defined]
    plant, board = deviating_plant(default_plant(), {name: 0.1}), deviating_board(default_board(), {name: 2e-3})
    before = default_plant()
    if name == "computing_delay":
        assert board.timing.computing_delay == default_board().timing.computing_delay + 2000
        return
    assert board == default_board()
    key, _, joint = name.rpartition("_")
    if key == "coulomb_arm":
        arms = [0.0, 0.0, 0.0]
        arms[int(joint) - 1] = 0.1 * before.friction.effective_arm
        assert plant.friction.extra_arms == pytest.approx(tuple(arms))
        assert (plant.rigid_body, plant.joints) == (before.rigid_body, before.joints)
    elif joint.isdigit():
        number = int(joint) - 1
        assert getattr(plant.joints[number], key) == pytest.approx(1.1 * getattr(before.joints[number], key))
        assert [a == b for a, b in zip(plant.joints, before.joints, strict=True)] == [k != number for k in range(6)]
    else:
        assert getattr(plant.rigid_body, name) == pytest.approx(1.1 * getattr(before.rigid_body, name))
        assert plant.joints == before.joints


def test_harmonics_have_the_size_of_those_in_the_potentiometers_curves() -> None:
    limit = 0.0025 * 4096
    curves = [LinearityCurve(Random(seed), limit) for seed in range(300)]
    shares = np.fft.rfft([[curve.at(64.0 * cell) for cell in range(64)] for curve in curves], axis=1) / 32
    for harmonic in HARMONICS:
        both = np.concatenate([shares[:, harmonic].real, shares[:, harmonic].imag])
        spread = float(both.std())
        assert spread == pytest.approx(harmonic_deviation(0.0025, harmonic), rel=0.15)


# ---- Memory maps that a seed draws


@pytest.mark.parametrize("documented", ["kept", "moved"])
def test_every_seed_draws_a_valid_map_the_same_each_time(documented: Documented) -> None:
    for seed in range(40):
        memory = draw_memory(seed, documented)
        assert memory.truth() == draw_memory(seed, documented).truth()
        used = [address for register in memory.map.registers.values() for address in register.addresses]
        used += [address for other in memory.others for address in other.addresses]
        assert len(used) == len(set(used)) <= memory.map.size


def test_a_bridge_with_another_map_stops_at_the_wrong_bytes_and_writes_are_counted() -> None:
    device = make_device(secret_map=4, documented="moved", lock_step=True)
    board = device.board
    board.run_until(100_000)
    before = board.memory.values("set_point")
    board.freeze()
    assert board.memory.values("set_point") == before or board.written == {}
    assert board.host_memory.map == default_memory_map()
    board = make_device(secret_map=4, lock_step=True).board
    board.write(0xFC10, b"\x01\x02")
    assert dict(board.written) == {0xFC10: 1, 0xFC11: 1}
    shipped = default_memory_map()["position"]
    documented = {*shipped.low[:3], *shipped.high[:3]}
    for seed in range(20):
        kept, moved = draw_memory(seed, "kept").map["position"], draw_memory(seed, "moved").map["position"]
        assert kept.low[:3] == shipped.low[:3]
        assert not documented & set(moved.addresses)


# ---- Potentiometers that a seed draws

STATED = default_board().calibrations


def test_every_seed_draws_sensors_near_the_stated_ones_told_in_degrees() -> None:
    directions = set()
    for seed in range(40):
        sensors = draw_sensors(seed, STATED)
        assert sensors == draw_sensors(seed, STATED)
        for found, stated in zip(sensors, STATED, strict=True):
            assert abs(found.range_rad / stated.range_rad - 1) <= 2 * RANGE_DEVIATION + 1e-12
            assert abs(found.counts_to_rad(2048) - stated.counts_to_rad(2048)) <= TURNED + 1e-12
            directions.add(found.direction)
    assert directions == {-1, 1}
    (first, *_) = draw_sensors(3, STATED)
    assert truth_of([first])[0]["range_deg"] == pytest.approx(math.degrees(first.range_rad), abs=1e-3)


# ---- A secret is told to nobody

SEED = compose_seed(8, Kind.PAIR, Load.LIGHT)
ASKED = ("help", "state", "counts", "snapshots", "fault_list", "modifications")


def give_aways(seed: int) -> list[str]:
    """Words and numbers that would betray an arm: names of effects, parameters, deviations, true constants."""
    arm = draw_arm(seed)
    numbers = [value for effect in arm.effects for values in effect.parameters for value in values.values()]
    numbers += [*arm.deviations.values(), *(1 + value for value in arm.deviations.values())]
    telling = [repr(value)[:9] for value in numbers if isinstance(value, float) and len(repr(value)) > 8]
    return [*known_modifications(), arm.kind.name.lower() + '"', *telling]


@pytest.mark.parametrize("kind", list(Kind))
def test_the_control_port_tells_nothing(kind: Kind) -> None:
    seed = compose_seed(5, kind, Load.NOMINAL)
    device = make_device(secret=seed)
    device.board.write_set_points({1: 510, 2: 340})
    device.board.run_until(200_000)
    control = Control(device, RecordedProcess())
    said = b"".join(control.execute(json.dumps({"do": name}).encode()) for name in ASKED).decode()
    assert not [word for word in give_aways(seed) if word in said]
    state = json.loads(control.execute(b'{"do": "state"}'))
    assert state["angles_rad"] is None
    assert state["motor_volts"] is None


def test_process_arguments_and_output_hold_the_seed_and_nothing_else() -> None:
    with RunningMock("--tcp", "127.0.0.1:0", "--lock-step", "--secret", str(SEED)) as mock:
        pid = mock._process.pid
        arguments = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
        environment = Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace")
        answers = json.dumps([mock.control(name) for name in ASKED])
        mock._process.stdin.close()
        mock._process.wait(10)
        left = mock._process.stdout.read().decode()
        assert [word for word in arguments if "secret" in word or str(SEED) in word] == ["--secret", str(SEED)]
        assert left == "", "nothing but the line that says it is ready"
        told = answers + environment + " ".join(arguments)
        assert not [word for word in give_aways(SEED) if word in told]


def test_a_secret_repeats_to_the_bit_and_greets_as_any_other_mock() -> None:
    # A secret repeats to the bit and noise is another seed
    def snapshots(seed: int) -> list[Any]:
        board = make_device(secret=SEED, seed=seed).board
        board.write_set_points({1: 510, 2: 340, 3: 490})
        board.run_until(500_000)
        return board.snapshots.after(0)

    assert snapshots(1) == snapshots(1)
    first, second = snapshots(1), snapshots(2)
    assert first != second
    worst = max(
        abs(a - b)
        for one, two in zip(first, second, strict=True)
        for a, b in zip(one.positions, two.positions, strict=True)
    )
    assert worst <= 6, "another noise, the same potentiometers"
    # A host is greeted as by any other mock
    assert LockStepHost(secret=SEED).ask(Hello(2, 1)) == LockStepHost().ask(Hello(2, 1))
    # Secret and modify are one or the other
    with pytest.raises(OptionsError, match="secret and modify"):
        read_options(["--pty", "--secret", "20", "--modify", "payload:mass=1"])
    assert read_options(["--pty", "--secret", "20"]).secret == 20
