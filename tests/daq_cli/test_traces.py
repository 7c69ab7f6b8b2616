"""`daq traces`: tables as traces, files made to do harm, and names of files that a CSV never replaces."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from daq.traces.reader import read_trace
from tests.daq.traces.samples import write
from tests.daq.traces.test_hostile_files import bomb
from tests.daq.traces.test_scan import foreign, ours
from tests.daq_cli.invoke import CommandLine


def test_a_table_is_shown_plotted_verified_and_exported_as_it_is(daq: CommandLine, tmp_path: Path) -> None:
    path = tmp_path / "RIG.CSV"
    path.write_text("time,position_1,drive_1\n0,0,1\n0.1,1,1\n20.1,1,1\n0.2")
    shown = daq("traces", "show", path).out
    assert "at most 20 s (after 0.1 s); it has no ticks, so missing samples cannot be detected" in shown
    assert "its last row has no line end" in shown
    assert "is CSV, without checksums" in daq("traces", "verify", path).out
    assert daq("traces", "plot", path, "-o", tmp_path / "a.png").code == 0
    assert daq("traces", "export", path, "-o", tmp_path / "b.csv").code == 0
    daq("traces", "export", path).complains(2, "is CSV already; name the file to write with -o")
    made = json.loads(daq("traces", "import", path, "--drive-unit", "Nm", "--json").out)
    assert read_trace(Path(made["file"])).record.drive_unit == "N·m"


def test_names_of_files_that_are_no_text_are_listed_as_json_that_reads_back(daq: CommandLine, tmp_path: Path) -> None:
    trace = write(tmp_path / "a.mcap", 3)
    named = tmp_path / "b\udcff.mcap"
    trace.rename(named)
    listed = daq("traces", "ls", "--folder", tmp_path, "--json").out
    listed.encode("utf-8")
    assert json.loads(listed)[0]["path"] == str(named)


# ---- a CSV never takes the place of a configuration or a machine file that has the name of its TOML


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


@pytest.mark.parametrize("name", ["a.toml", "a.mcap", "a.xlsx", "a"])
def test_a_csv_is_named_as_one_so_that_it_replaces_neither_its_trace_nor_its_toml(
    daq: CommandLine, tmp_path: Path, name: str
) -> None:
    trace = write(tmp_path / "a.mcap", 3)
    before = trace.read_bytes()
    daq("traces", "export", trace, "-o", tmp_path / name).complains(2, name, "is no .csv file")
    assert trace.read_bytes() == before
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["a.mcap"]


def test_a_trace_is_exported_again_and_to_a_table_in_capitals(daq: CommandLine, tmp_path: Path) -> None:
    trace = write(tmp_path / "a.mcap", 3)
    for name in ("a.csv", "a.csv", "a.PARQUET"):
        assert daq("traces", "export", trace, "-o", tmp_path / name).code == 0
    assert (tmp_path / "a.PARQUET").read_bytes()[:4] == b"PAR1"


# ---- files made to do harm: one line and the documented exit code, never a traceback


FILES = {
    "joints": (lambda: foreign(ours() | {"joints": ""}), "joints = ''"),
    "nested": (lambda: foreign(ours() | {"record": '{"a":' * 10**5}), "its metadata is not that of a trace"),
    "created": (lambda: foreign(ours(created="9999-12-31T23:59:59-14:00")), "the years 1970 to 2261"),
    "bomb": (lambda: bomb(2**62, 1000), "declares more than 67108864 bytes (traces.limits.chunk_bytes)"),
}


@pytest.mark.parametrize("kind", FILES)
def test_a_malicious_trace_is_refused_in_one_line(daq: CommandLine, tmp_path: Path, kind: str) -> None:
    make, complaint = FILES[kind]
    path = tmp_path / f"{kind}.mcap"
    path.write_bytes(make())
    for words in (["show", path], ["plot", path], ["export", path, "-o", tmp_path / "a.csv"]):
        daq("traces", *words).complains(2, str(path), complaint)
    verified = daq("traces", "verify", path)
    assert (verified.code, verified.err) == (5, "")
    assert complaint in verified.out
    listed = daq("traces", "ls", "--folder", tmp_path, "--json")
    assert (listed.code, listed.err) == (0, "")
    assert kind == "bomb" or complaint in listed.out


@pytest.mark.parametrize(
    ("text", "toml", "complaint"),
    [
        ("-1e308,0\n1e308,1", "", "row 2, column 'time': -1e+308 is too large, allowed is ±4e+09 s"),
        ("0,0\n1,1e308", "", "row 3, column 'position_1': 1e+308 is too large, allowed is ±1e+09 rad or m"),
        ("0,0\n1e-320,0", "", "row 3, column 'time': 1e-320 does not increase after 0.0 by at least 1e-09 s"),
        ("-0.0,0\n0,0", "", "row 3, column 'time': 0.0 does not increase after -0.0"),
        ("0,\0", "", "row 2, column 'position_1'"),
        ("0," + "9" * 200_000, "", "is not CSV: field larger than field limit"),
        ("0,0", "a = " + "[" * 5000, "nested more than 64 levels deep"),
        ("0,0", "notes = " + "[" * 70 + "]" * 70, "nested more than 64 levels deep"),
        ("0,0", "notes = 0x" + "f" * 6000, "a whole number has more than a thousand digits"),
        ("0,0", "notes = 0x" + "f" * 600, "notes: found 0xffff"),
        ("0,0", ".".join(["a"] * 5000) + " = 1", "a key has more than 64 parts"),
        ("0,0\n\n1,1\n\n1,2", "", "row 6, column 'time': 1.0 does not increase after 1.0"),
        ("0,0", "created = 9999-12-31T23:59:59-14:00", "created: must be a time of the years 1970 to 2261"),
        ("0,0", "created = 2020-01-01T00:00:00", "created: 2020-01-01T00:00:00 has no time zone; write Z behind it"),
        ("0,0", "period = 1e-300", "period = 1e-300 s, allowed is 1e-06 to 86400 s"),
        ("", "", "has no row below its header"),
    ],
)
def test_a_malicious_csv_is_refused_in_one_line(
    daq: CommandLine, tmp_path: Path, text: str, toml: str, complaint: str
) -> None:
    path = tmp_path / "rig.csv"
    path.write_text(f"time,position_1\n{text}\n")
    if toml:
        path.with_suffix(".toml").write_text(toml)
    daq("traces", "import", path, "--folder", tmp_path / "traces").complains(2, str(tmp_path), complaint)
    assert not list((tmp_path / "traces").glob("*")) if (tmp_path / "traces").exists() else True


def test_a_pipe_in_place_of_a_file_is_refused_at_once(daq: CommandLine, tmp_path: Path) -> None:
    daq("traces", "import", "/dev/zero").complains(2, "/dev/zero", "it is no file")
    (tmp_path / "rig.csv").write_text("time,position_1\n0,0\n1,1\n")
    (tmp_path / "rig.toml").symlink_to("/dev/zero")
    daq("traces", "import", tmp_path / "rig.csv").complains(2, "rig.toml", "it is no file")
    daq("traces", "show", "a" * 5000).complains(2, "is not a file")


def test_configured_limits_of_traces_hold(daq: CommandLine, tmp_path: Path) -> None:
    path = write(tmp_path / "a.mcap", 50)
    Path("daq.toml").write_text("[traces.limits]\njoints = 2\n")
    daq("traces", "show", path).complains(2, "joints = '1 2 3' are not 1 to 2 different", "(traces.limits.joints)")
    Path("daq.toml").write_text("[traces.limits]\njoint = 2\n")
    daq("traces", "show", path).complains(2, "traces.limits.joint", "chunk_bytes")


def test_control_characters_in_a_file_name_are_not_printed(daq: CommandLine, tmp_path: Path) -> None:
    path = write(tmp_path / "a\x1b[2J.mcap", 3)
    for words in (("show", path), ("export", path)):
        shown = daq("traces", *words)
        assert shown.code == 0
        assert "a\N{REPLACEMENT CHARACTER}[2J" in shown.out
        assert "\x1b" not in shown.out


def test_bytes_that_were_not_salvaged_are_named_with_their_file(daq: CommandLine, tmp_path: Path) -> None:
    data = write(tmp_path / "a.mcap", 50).read_bytes()
    (tmp_path / "a.mcap").rename(tmp_path / "a.mcap.part")
    with (tmp_path / "a.mcap.part").open("ab") as stream:
        stream.write(b"noise")
    (tmp_path / "b.mcap.part").write_bytes(data[:100])
    said = daq("traces", "salvage", "--folder", tmp_path)
    assert said.code == 5
    first, second = said.out.splitlines()
    assert first.endswith(
        "a.mcap: salvaged from a.mcap.part up to its damage; the 13 bytes after it are in a.mcap.part.damaged"
    )
    assert second.endswith("b.mcap.part: holds no trace; it was renamed to b.mcap.part.unreadable")
