"""Figures of an imported record: in the units that its file allows to know."""

from pathlib import Path

import pytest

from daq.traces.csv_table import INTEGRATED, import_csv
from daq.traces.summary import joint_figures


@pytest.mark.parametrize(("unit", "shown", "end"), [("N", "mm", 250.0), ("N·m", "°", 14.3239)])
def test_a_record_of_forces_without_a_machine_is_of_a_sliding_joint(
    tmp_path: Path, unit: str, shown: str, end: float
) -> None:
    path = tmp_path / "axis.csv"
    path.write_text("time,drive_1,position_1\n0,1.5,0.1\n0.01,2.5,0.25\n")
    path.with_suffix(".toml").write_text(f'robot = "axis"\ndrive_unit = "{unit}"\n', "utf-8")
    (figures,) = joint_figures(import_csv(path))
    assert figures.unit == shown
    assert figures.end == pytest.approx(end, rel=1e-4)


def test_a_record_of_speeds_alone_is_integrated_by_the_trapezoidal_rule_and_says_so(tmp_path: Path) -> None:
    path = tmp_path / "axis.csv"
    path.write_text("time,velocity_1,velocity_4\n1,0,1\n2,2,1\n4,4,-3\n")
    found = import_csv(path)
    assert found.joints == (1, 4)
    assert found.position.tolist() == [[0, 0], [1, 1], [7, -1]]
    assert found.velocity is not None
    assert found.velocity.tolist() == [[0, 1], [2, 1], [4, -3]]
    assert INTEGRATED in found.record.notes
