"""Every file and number that a command of models takes, given what nobody means: one line, exit code of wrong input."""

from pathlib import Path

import pytest

from tests.daq_cli.hostile import FILES, hostile_file, refuses
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import SINGLE_AXIS, write_csv

READERS = {
    "validate {} good.csv": ".json",
    "simulate {} good.csv": ".toml",
    "compare {} single.toml good.csv": ".json",
    "diagnose good.csv --model {}": ".json",
    "fit good.csv --machine {} -o out.json": ".toml",
    "simulate single.toml good.csv --effect-file {}": ".py",
    "design ma2000 --judge {}": ".json",
}


@pytest.fixture(autouse=True)
def rig(empty_folder: Path) -> None:
    """A trace and the machine that it is of."""
    write_csv(empty_folder / "good.csv")
    Path("single.toml").write_text(SINGLE_AXIS.read_text("utf-8"))


@pytest.mark.parametrize("kind", FILES)
@pytest.mark.parametrize("words", READERS)
def test_a_hostile_file_is_refused_in_one_line(daq: CommandLine, words: str, kind: str) -> None:
    refuses(daq(*words.format(hostile_file(kind, READERS[words])).split()))


@pytest.mark.parametrize("value", ["nan", "inf", "-1", "1e400", "0", "x", "9" * 6000])
@pytest.mark.parametrize(
    "words",
    [
        "validate single.toml good.csv --damping-ratio={}",
        "diagnose good.csv --model single.toml --load={}",
        "design single.toml --duration={}",
        "diagnose good.csv --acquire --budget={}",
        "design single.toml --experiments={}",
        "fit good.csv --machine single.toml -o out.json --starts={}",
        "validate single.toml good.csv --joint={}",
        "fit good.csv --machine single.toml -o out.json --bound=link1.mass={}:{}",
        "blind --folder t --seeds=1 --executor={}",
        "blind --folder t --seeds=1 --cases={}",
    ],
)
def test_a_number_without_meaning_is_refused_in_one_line(daq: CommandLine, words: str, value: str) -> None:
    if "--load" in words and value == "0":
        return
    refuses(daq(*words.format(value, value).split()))


def test_configured_limits_of_traces_hold_for_a_csv(daq: CommandLine) -> None:
    Path("daq.toml").write_text("[traces.limits]\nrecords = 20\n")
    daq("simulate", "single.toml", "good.csv").complains(2, "good.csv", "traces.limits.records")
