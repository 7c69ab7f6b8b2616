"""The plant's data file: every number with unit and source, anything odd refused in one line."""

import pytest

from mock_controller.plant.parameters import default_plant_text, parse_plant
from mock_controller.quantities import DataFileError


def test_every_number_says_whether_it_is_documented_or_assumed() -> None:
    _, provenance = parse_plant(default_plant_text())
    assert len(provenance) == 13 + 2 + 2 + 66
    by_name = {entry.name: entry for entry in provenance}
    assert by_name["rigid_body.m2"].kind == "documented"
    assert by_name["joint_4.gear_ratio"].kind == "assumed"


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('unit = "kg"', 'unit = "g"', "rigid_body.m1: unit is 'g', must be 'kg'"),
        ("documented: table 7.9", "table 7.9", "source must be"),
        ("value = 28.0", "value = -1", "amplifier.gain: value is -1, allowed are"),
        ("value = 28.0", "value = nan", "amplifier.gain: value is nan"),
        ("[amplifier]", "[amplifire]", "amplifier.gain: must be"),
        ("[amplifier]", "[amplifier]\ncolour = 3", "amplifier.colour: not a quantity"),
        ('value = 45, unit = "deg"', 'value = 340, unit = "deg"', "lower_stop 340.0 deg must be below"),
        ("[amplifier]", "[amplifier", "not TOML"),
    ],
)
def test_faulty_file_is_refused_in_one_line(old: str, new: str, says: str) -> None:
    with pytest.raises(DataFileError, match=says) as caught:
        parse_plant(default_plant_text().replace(old, new, 1))
    assert "\n" not in str(caught.value)
