"""Servos and motors by name, and a load that the arm carries."""

import pytest

from daq.contracts.carried_load import LEAST_DEVIATION, carrying
from daq.contracts.drive_library import LibraryDrive, library_drive, library_drives
from daq.contracts.errors import SpecError
from daq.contracts.machine import CurrentDrive, DcMotor, Machine, SampledPid, load_machine, parse_machine
from daq.contracts.quantity import Quantity
from daq.contracts.written_numbers import UNSTATED

PAN_TILT = """
name = "pan-tilt"
controller = { kind = "servo", gains = [16, 0, 32], pwm_limit = "50 %" }
[[joints]]
name = "pan"
geometry = { alpha = "90 deg" }
link = { mass = "0.15 ± 0.015 kg", radius = "40 ± 4 mm" }
drive = "feetech/sts3215-7.4V"
[[joints]]
name = "tilt"
like = "pan"
geometry = { a = "160 mm", theta = "-180 deg" }
link = { mass = "0.12 kg" }
"""


def pendulum(drive: str) -> Machine:
    joint = f'name = "axis"\ngeometry = {{ a = 0.1 }}\nlink = {{ mass = 0.1 }}\ndrive = "{drive}"'
    return parse_machine(f'name = "rod"\n[[joints]]\n{joint}\n')


@pytest.mark.parametrize("known", library_drives().values(), ids=lambda known: known.name)
def test_every_drive_of_the_library_has_numbers_with_source_and_deviation(known: LibraryDrive) -> None:
    drive, friction = pendulum(known.name).joint(1).drive, pendulum(known.name).joint(1).friction
    assert isinstance(drive, DcMotor | CurrentDrive)
    numbers = [drive.torque_constant, drive.rotor_inertia, friction.viscous]
    numbers += [drive.resistance, drive.back_emf_constant] if isinstance(drive, DcMotor) else [drive.gear_ratio]
    for number in numbers:
        assert isinstance(number, Quantity)
        assert number.source not in ("", UNSTATED)
        assert (number.deviation is not None and number.deviation > 0.0) or number is getattr(drive, "gear_ratio", None)


def test_the_library_has_the_servos_that_people_have_and_its_numbers_give_way_to_the_files() -> None:
    assert len(library_drives()) >= 25
    with pytest.raises(SpecError, match=r"did you mean 'feetech/sts3215-12V' or 'feetech/sts3215-7.4V'"):
        library_drive("feetech/sts3215")
    text = PAN_TILT.replace('"feetech/sts3215-7.4V"', '{ model = "feetech/sts3215-7.4V", resistance = "2.5 Ω" }')
    motor = parse_machine(text).joint(2).dc_motor
    assert (motor.resistance.value, motor.resistance.deviation) == (2.5, None)
    assert motor.torque_constant.source.startswith("BAM m1")
    text = PAN_TILT.replace('"feetech/sts3215-7.4V"', '{ model = "feetech/sts3215-7.4V", supply_limit = "6 V" }')
    controller = parse_machine(text).controller
    assert isinstance(controller, SampledPid)
    assert controller.gains[0][0] == pytest.approx(16 * 0.166 * 6.0)
    assert isinstance(controller.output_limit, Quantity)
    assert controller.output_limit.value == pytest.approx(0.97 * 6.0 / 2)


def test_a_servos_registers_become_the_pid_of_its_firmware() -> None:
    assert len(PAN_TILT.strip().splitlines()) <= 12
    controller = parse_machine(PAN_TILT).controller
    assert isinstance(controller, SampledPid)
    assert [gain for row in controller.gains for gain in row] == pytest.approx([16 * 0.166 * 7.4, 0.0, 0.0] * 2)
    limit, band = controller.output_limit, controller.dead_band
    assert isinstance(limit, Quantity)
    assert limit.value == pytest.approx(0.97 * 7.4 / 2)
    assert isinstance(band, Quantity)
    assert band.value == pytest.approx(2 * 3.14159265 / 4096)
    plain = parse_machine(
        PAN_TILT.replace('controller = { kind = "servo", gains = [16, 0, 32], pwm_limit = "50 %" }', "")
    )
    assert isinstance(plain.controller, SampledPid)
    assert plain.controller.gains[0][0] == pytest.approx(32 * 0.166 * 7.4)
    text = PAN_TILT.replace("feetech/sts3215-7.4V", "cubemars/ak60-6")
    with pytest.raises(SpecError, match=r"controller: kind is 'servo', but no position servo drives joint 1, 2"):
        parse_machine(text)


# ---- A load that is told is known as well as the machine file's own, relative to its size

ARM = load_machine("ma2000")


def with_load(**fields: float | None) -> Machine:
    """The arm whose file states another load."""
    stated = {"value": 1.0, "deviation": 0.1, **fields}
    return ARM.model_copy(update={"load": Quantity(unit="kg", source="test", **stated)})


@pytest.mark.parametrize(
    ("stated", "kilograms", "deviation"),
    [
        ({}, 0.4, 0.04),
        ({}, 2.5, 0.25),
        ({}, 0.0, LEAST_DEVIATION),
        ({"value": 0.0, "deviation": 0.05}, 2.0, 0.05),
        ({"deviation": None}, 2.0, None),
    ],
    ids=["grows with the load", "and with more", "none to a gram", "file without load", "not claimed by the file"],
)
def test_the_deviation_is_that_of_the_file_and_grows_with_the_load(
    stated: dict[str, float | None], kilograms: float, deviation: float | None
) -> None:
    load = carrying(with_load(**stated), kilograms, "told").load
    assert load is not None
    assert (load.value, load.source, load.assumed) == (kilograms, "told", False)
    assert load.deviation == (None if deviation is None else pytest.approx(deviation))


def test_a_load_that_the_machine_cannot_carry_is_refused() -> None:
    with pytest.raises(SpecError, match="has no load in its machine file"):
        carrying(ARM.model_copy(update={"load": None}), 1.0, "told")
    with pytest.raises(SpecError, match=r"load -1 kg: .* allows at least 0 kg"):
        carrying(ARM, -1.0, "told")
    with pytest.raises(SpecError, match=r"load 4 kg: .* allows 0.5 to 3 kg"):
        carrying(with_load(low=0.5, high=3.0), 4.0, "told")
