"""A trace's CSV never takes the place of a configuration or a machine file that has the name of its TOML."""

from pathlib import Path

import pytest

from tests.daq.traces.samples import write
from tests.daq_cli.invoke import CommandLine


@pytest.mark.parametrize(
    "text", ['operator = "anna"\n', '[robot]\nname = "bench"\n', "", 'machine = "rig.toml"\ndrive_unit = "V"\n', "no"]
)
def test_a_toml_that_is_no_traces_is_not_replaced(daq: CommandLine, tmp_path: Path, text: str) -> None:
    trace = write(tmp_path / "a.mcap", 3)
    other = tmp_path / "other.toml"
    other.write_text(text)
    daq("traces", "export", trace, "-o", tmp_path / "other.csv").complains(2, "other.csv", "other.toml", "another name")
    assert other.read_text() == text
    assert not (tmp_path / "other.csv").exists()


def test_the_same_trace_is_exported_again(daq: CommandLine, tmp_path: Path) -> None:
    trace = write(tmp_path / "a.mcap", 3)
    for _ in range(2):
        assert daq("traces", "export", trace, "-o", tmp_path / "a.csv").code == 0


@pytest.mark.parametrize("name", ["a.toml", "a.mcap", "a.xlsx", "a"])
def test_a_csv_is_named_as_one_so_that_it_replaces_neither_its_trace_nor_its_toml(
    daq: CommandLine, tmp_path: Path, name: str
) -> None:
    trace = write(tmp_path / "a.mcap", 3)
    before = trace.read_bytes()
    daq("traces", "export", trace, "-o", tmp_path / name).complains(2, name, "is no .csv file")
    assert trace.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["a.mcap"]


def test_a_table_in_capitals_is_one_all_the_same(daq: CommandLine, tmp_path: Path) -> None:
    trace = write(tmp_path / "a.mcap", 3)
    assert daq("traces", "export", trace, "-o", tmp_path / "a.PARQUET").code == 0
    assert (tmp_path / "a.PARQUET").read_bytes()[:4] == b"PAR1"
