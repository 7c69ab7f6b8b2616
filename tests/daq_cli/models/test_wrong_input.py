"""What cannot give a model is refused in one line that says what, where and what is allowed; no file is written."""

from pathlib import Path
from typing import Any

import pytest

from tests.daq_cli.hostile import FILES, hostile_file, refuses
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import SINGLE_AXIS, write_csv

EIGHT_EFFECTS = "viscous,coulomb,stribeck,stiction,torque_ripple,gear_loss,spring,potentiometer_gain"


def refused(daq: CommandLine, *words: object, says: tuple[str, ...], code: int = 2) -> None:
    daq(*words).complains(code, *says)
    assert not Path("out.json").exists()


def fitting(*traces: object) -> tuple[object, ...]:
    return ("fit", *traces, "--machine", SINGLE_AXIS, "-o", "out.json")


def test_a_machine_without_inertia_is_refused(daq: CommandLine, tmp_path: Path) -> None:
    text = SINGLE_AXIS.read_text().replace("0.8 ± 0.08 kg", "0 ± 0.08 kg")
    text = text.replace("0.004 ± 0.0008 kg·m²", "0 ± 0.0008 kg·m²")
    (tmp_path / "weightless.toml").write_text(text)
    trace = write_csv(tmp_path / "good.csv")
    words = ("fit", trace, "--machine", tmp_path / "weightless.toml", "-o", "out.json")
    refused(daq, *words, says=("joint 1 has no inertia",))


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("--effects warp_drive", ("effect 'warp_drive'", "it has viscous_friction, quadratic_drag, ")),
        ("--effects st", ("effect 'st'", "could be", "stribeck_friction", "stiction")),
        ("--effects viscous:2", ("viscous_friction on joint 2", "[1]")),
        ("--effects payload:1", ("payload", "whole machine")),
        ("--effects viscous,viscous", ("viscous_friction", "twice")),
        ("--parameters link7.mass", ("link7.mass", "not in this model")),
        ("--parameters ,", ("no parameter named",)),
        ("--model model.json", ("--model and --machine",)),
        ("--bound link1.mass=2:1", ("link1.mass=2:1", "lower bound 2 is not below the upper 1")),
        ("--bound link1.mass=much:", ("link1.mass=much:", "numbers")),
    ],
)
def test_options_that_cannot_be_fitted_are_refused(
    daq: CommandLine, tmp_path: Path, words: str, says: tuple[str, ...]
) -> None:
    trace = write_csv(tmp_path / "good.csv")
    refused(daq, *fitting(trace), *words.split(), says=says)


@pytest.mark.parametrize(
    ("motion", "words", "says"),
    [
        ({"amplitude": 0.0}, "", ("no motion", "4 counts")),
        ({"count": 2}, "", ("2 samples", "at least 3")),
        ({"count": 12}, f"--effects {EIGHT_EFFECTS} --parameters *", ("12 samples for", "more samples than")),
    ],
    ids=["still", "two samples", "fewer than parameters"],
)
def test_a_trace_that_says_too_little_is_refused(
    daq: CommandLine, tmp_path: Path, motion: dict[str, Any], words: str, says: tuple[str, ...]
) -> None:
    refused(daq, *fitting(write_csv(tmp_path / "little.csv", **motion)), *words.split(), says=says)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("fit nothing -o missing/out.json", ("--out missing/out.json", "no folder")),
        ("diagnose nothing -o missing/out.json", ("--out missing/out.json", "no folder")),
        ("diagnose nothing --report missing/page.html", ("report missing/page.html", "no folder")),
        ("fit nothing -o out.json --torques --starts 3", ("--torques", "--starts")),
        ("fit nothing -o out.json --torques --open-loop", ("--torques", "--open-loop")),
        ("fit nothing -o out.json --torques --method nelder_mead", ("--torques", "--method")),
        ("fit nothing -o out.json --torques --seed 2", ("--torques", "--seed")),
    ],
)
def test_wrong_options_are_refused_before_a_trace_is_read(daq: CommandLine, words: str, says: tuple[str, ...]) -> None:
    refused(daq, *words.split(), says=says)


@pytest.mark.parametrize(
    ("words", "joints", "says"),
    [
        (("compare", SINGLE_AXIS), 1, ("1 model named", "at least two")),
        (("compare", SINGLE_AXIS, "ma2000"), 3, ("cannot be compared", "[1, 2, 3]")),
        (("simulate", SINGLE_AXIS, "--report", "page.txt"), 1, ("page.txt", ".html")),
    ],
    ids=["one model", "models of different joints", "a report that is not HTML"],
)
def test_what_cannot_be_compared_or_reported_is_refused(
    daq: CommandLine, tmp_path: Path, words: tuple[object, ...], joints: int, says: tuple[str, ...]
) -> None:
    refused(daq, *words, write_csv(tmp_path / "good.csv", joints=joints), says=says)


# ---- every file and number, given what nobody means


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
