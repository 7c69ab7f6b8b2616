"""A secret is told to nobody: not on the wire, the control port, standard output, or in the process's arguments."""

import json
from pathlib import Path
from typing import Any

import pytest

from firmware_protocol.commands import Hello
from mock_controller.control import Control
from mock_controller.hidden.arm import Kind, Load, compose_seed, draw_arm
from mock_controller.modifications.library import LIBRARY
from mock_controller.options import OptionsError, read_options
from tests.mock.host import LockStepHost, make_device
from tests.mock.process.running import RunningMock
from tests.mock.process.test_control import RecordedProcess

SEED = compose_seed(8, Kind.PAIR, Load.LIGHT)
ASKED = ("help", "state", "counts", "snapshots", "fault_list", "modifications")


def give_aways(seed: int) -> list[str]:
    """Words and numbers that would betray an arm: names of effects, parameters, deviations, true constants."""
    arm = draw_arm(seed)
    numbers = [value for effect in arm.effects for values in effect.parameters for value in values.values()]
    numbers += [*arm.deviations.values(), *(1 + value for value in arm.deviations.values())]
    telling = [repr(value)[:9] for value in numbers if isinstance(value, float) and len(repr(value)) > 8]
    return [kind.name for kind in LIBRARY] + [arm.kind.name.lower() + '"', *telling]


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


def test_a_host_is_greeted_as_by_any_other_mock() -> None:
    assert LockStepHost(secret=SEED).ask(Hello(2, 1)) == LockStepHost().ask(Hello(2, 1))


def test_process_arguments_and_output_hold_the_seed_and_nothing_else() -> None:
    with RunningMock("--tcp", "127.0.0.1:0", "--lock-step", "--secret", str(SEED)) as mock:
        pid = mock._process.pid
        arguments = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
        environment = Path(f"/proc/{pid}/environ").read_bytes().decode(errors="replace")
        answers = json.dumps([mock.control(name) for name in ASKED])
        assert mock._process.stdin is not None
        assert mock._process.stdout is not None
        mock._process.stdin.close()
        mock._process.wait(10)
        left = mock._process.stdout.read().decode()
        assert [word for word in arguments if "secret" in word or str(SEED) in word] == ["--secret", str(SEED)]
        assert left == "", "nothing but the line that says it is ready"
        told = answers + environment + " ".join(arguments)
        assert not [word for word in give_aways(SEED) if word in told]


def test_a_secret_repeats_to_the_bit_and_noise_is_another_seed() -> None:
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


def test_secret_and_modify_are_one_or_the_other() -> None:
    with pytest.raises(OptionsError, match="secret and modify"):
        read_options(["--pty", "--secret", "20", "--modify", "payload:mass=1"])
    assert read_options(["--pty", "--secret", "20"]).secret == 20
