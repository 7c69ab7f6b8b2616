"""Lengths and angles as people type them: neither is taken for the other."""

import math
from pathlib import Path

import pytest

from daq.contracts.errors import SpecError
from daq_cli.app.quantities import Length, parse_angle, parse_per_joint_angles, require_units
from tests.daq.sliding_axis import SLIDE_AND_TURN, slide_and_turn
from tests.daq_cli.invoke import CommandLine


def test_units() -> None:
    assert parse_angle("180", "a") == math.pi
    assert parse_angle(" 90deg ", "a") == parse_angle("90°", "a") == math.pi / 2
    assert parse_angle("0.5rad", "a") == 0.5
    assert parse_angle("30mm", "a") == pytest.approx(0.03)
    assert parse_angle("0.03m", "a") == 0.03
    assert isinstance(parse_angle("30mm", "a"), Length)
    assert not isinstance(parse_angle("30", "a"), Length)


@pytest.mark.parametrize("text", ["30cm", "m", "3 0mm", "30mmm", "1e400 mm m"])
def test_what_is_no_quantity(text: str) -> None:
    with pytest.raises(SpecError, match="write an angle like"):
        parse_angle(text, "amplitude")


@pytest.mark.parametrize(
    ("text", "said"),
    [(text, "joint 1 slides: write a length") for text in ("21.6", "0.03rad", "1=21.6", "1=3deg,2=5")]
    + [(text, "joint 2 turns: write an angle") for text in ("1=30mm,2=5mm", "2=0.1m")],
)
def test_an_angle_is_refused_for_a_joint_that_slides_and_a_length_for_one_that_turns(text: str, said: str) -> None:
    with pytest.raises(SpecError, match=said):
        require_units("amplitude", parse_per_joint_angles(text, "amplitude"), slide_and_turn(), (1, 2))


def test_each_joint_takes_its_own_and_nothing_is_both() -> None:
    machine = slide_and_turn()
    require_units("amplitude", parse_per_joint_angles("1=30mm,2=5", "amplitude"), machine, (1, 2))
    require_units("amplitude", parse_per_joint_angles("1=0,2=0", "amplitude"), machine, (1, 2))


def test_a_dry_run_of_a_sliding_joint(tmp_path: Path, daq: CommandLine) -> None:
    (tmp_path / "daq.toml").write_text(f'[robot]\nmachine = "{SLIDE_AND_TURN}"\n')
    config = ("--config", tmp_path / "daq.toml", "run", "ramp", "--joints", "1", "--dry-run")
    daq(*config).complains(2, "amplitude: joint 1 slides: write a length with its unit")
    shown = daq(*config, "--amplitude", "30mm", "--duration", "2")
    assert shown.code == 0, shown.err
    assert "joint 1: 100.00 mm → 130.00 mm" in shown.out
    assert "at most 15.0 mm/s" in shown.out
