"""What commands of models make of a swing whose torques are worked out by hand, sound or doubted."""

import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from model.arrays import Floats
from model.effects.library import own_effects, remove_own
from model.machine_model.model_file import load_model
from tests.daq_cli.invoke import CommandLine
from tests.daq_cli.models.conftest import ROOT, SINGLE_AXIS, swing_csv, write_csv, write_swing

# ---- `daq fit --torques`: what it prints, what its page shows, and what it calls the traces


LARGEST = 0.9
"""Of the recorded drive, V, in the records of which it stands at a limit."""
WORDS = ("--torques", "--machine", SINGLE_AXIS, "--parameters", "link1.mass,joint1.drive.inertia", "-o", "out.json")


@pytest.mark.timeout(300)
def test_parameters_errors_by_file_and_what_is_left_are_printed(daq: CommandLine) -> None:
    write_swing(Path("first.csv"), 1)
    write_swing(Path("second.csv"), 5)
    said = daq("fit", "first.csv", "--holdout", "second.csv", *WORDS)
    assert said.code == 0, said.err
    lines = said.out.splitlines()
    (mass,) = (line for line in lines if line.lstrip().startswith("link1.mass"))
    assert float(mass.split()[1]) == pytest.approx(0.8, rel=0.02)
    assert any(line.split()[:3] == ["first.csv", "in", "sample"] for line in lines)
    assert any(line.split()[:3] == ["second.csv", "held", "out"] for line in lines)
    assert any(line.startswith("left of the torque, all together: in sample ") for line in lines)
    assert "largest value" not in said.out
    assert "out.json" in said.err


@pytest.mark.timeout(300)
def test_a_drive_that_stood_at_its_limit_is_told_on_the_terminal_and_on_the_page(daq: CommandLine) -> None:
    write_swing(Path("clipped.csv"), 1, LARGEST)
    said = daq("fit", "clipped.csv", *WORDS, "--report", "page.html")
    assert said.code == 0, said.err
    note = "The recorded drive stands at its largest value ("
    assert note in said.out
    page = Path("page.html").read_text("utf-8")
    assert note in page
    assert "% of joint 1" in page
    assert "measured − simulated" not in page
    assert "clipped.csv" in page
    assert "page.html" in said.err


def test_an_error_calls_a_trace_as_the_command_line_does(daq: CommandLine) -> None:
    write_swing(Path("swing.csv"), 1)
    text = Path("swing.csv").read_text("utf-8").splitlines()
    Path("short.csv").write_text("\n".join(text[:100]) + "\n", "utf-8")
    Path("bare.csv").write_text("\n".join(line.rpartition(",")[0] for line in text) + "\n", "utf-8")
    daq("fit", "short.csv", *WORDS).complains(2, "daq: short.csv: lasts 0.485 s")
    daq("fit", "bare.csv", *WORDS).complains(2, "daq: bare.csv: has no recorded drive")
    daq("fit", "swing.csv", "swing.csv", *WORDS).complains(2, "daq: swing.csv: given more than once")
    daq("diagnose", "swing.csv", "--model", SINGLE_AXIS, "--holdout", "swing.csv").complains(
        2, "daq: swing.csv: is both fitted to and held out"
    )


# ---- `daq check`, and what every command of models does with a record that it doubts


SPIKES = (300, 500, 900)
COMMANDS = {
    "fit": ("fit", "{}", "--machine", SINGLE_AXIS, "-o", "out.json"),
    "torques": ("fit", "{}", *WORDS),
    "validate": ("validate", SINGLE_AXIS, "{}"),
    "profile": ("profile", SINGLE_AXIS, "{}", "--parameter", "link1.mass"),
    "compare": ("compare", SINGLE_AXIS, SINGLE_AXIS, "{}"),
    "simulate": ("simulate", SINGLE_AXIS, "{}"),
    "diagnose": ("diagnose", "{}", "--model", SINGLE_AXIS, "-o", "out.json"),
}


def changed(path: Path, *, spikes: bool = False, slower: float = 1.0) -> Path:
    """The swing with three false readings, or times so many times as long."""
    write_swing(path, 1)
    head, rows = path.read_text("utf-8").splitlines()[0], np.loadtxt(path, delimiter=",", skiprows=1)
    rows[:, 0] *= slower
    rows[list(SPIKES) if spikes else [], 2] += 0.7
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.9g")
    return path


def test_a_record_is_checked_and_its_faults_have_their_place(daq: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    write_swing(Path("sound.csv"), 1)
    assert daq("check", "sound.csv", "--model", SINGLE_AXIS).code == 0
    changed(Path("spiked.csv"), spikes=True)
    said = daq("check", "spiked.csv", "--model", SINGLE_AXIS)
    assert said.code == 2
    assert "CHECK spiked.csv: joint 1: 3 spikes at 1.50, 2.50, 4.50 s, of " in " ".join(said.out.split())
    assert max(map(len, said.out.splitlines())) <= 80
    said = daq("check", "spiked.csv", "--model", SINGLE_AXIS, "--json")
    told = json.loads(said.out)
    (found,) = [one for one in told["findings"] if one["consequence"] == "doubt"]
    assert [one["field"] for one in told["fields"]] == ["time", "position", "velocity", "set point", "drive"]
    assert (said.code, found["kind"], found["joint"], found["count"]) == (2, "spikes", 1, 3)
    assert found["times"] == pytest.approx([0.005 * row for row in SPIKES])


@pytest.mark.parametrize("words", COMMANDS.values(), ids=COMMANDS)
def test_nothing_is_computed_of_a_doubted_record(daq: CommandLine, words: tuple[object, ...]) -> None:
    changed(Path("spiked.csv"), spikes=True)
    said = daq(*(str(word).format("spiked.csv") for word in words))
    assert said.code == 2, said.err
    assert said.out.count("3 spikes") == 1, said.out
    assert "CHECK" in said.out
    assert not Path("out.json").exists()


def test_times_in_ms_are_said_before_anything_else_fails(daq: CommandLine) -> None:
    changed(Path("slow.csv"), slower=1000.0)
    said = daq("fit", "slow.csv", *WORDS)
    assert said.code == 2
    assert "CHECK" in said.out
    assert "cutoff" not in said.err


@pytest.mark.timeout(300)
def test_despite_doubts_a_model_is_computed_and_the_exit_code_says_so(daq: CommandLine) -> None:
    changed(Path("spiked.csv"), spikes=True)
    said = daq("fit", "spiked.csv", *WORDS, "--despite-doubts")
    assert said.code == 2
    assert Path("out.json").exists()
    assert "Check the record first: spiked.csv: joint 1: 3 spikes" in " ".join(said.out.split())


def test_a_trace_of_more_joints_than_the_machine_asks_for_its_own(daq: CommandLine) -> None:
    write_csv(Path("seven.csv"), joints=7)
    daq("check", "seven.csv").complains(2, "has a joint 7, and ma2000 has 6 joints; name its machine or model")
    daq("check", "seven.csv", "--model", SINGLE_AXIS).complains(2, "has a joint 7", "has 1 joint; is it of another")


def test_an_import_says_what_was_read_what_is_doubted_and_what_comes_next(daq: CommandLine) -> None:
    changed(Path("spiked.csv"), spikes=True)
    said = daq("traces", "import", "spiked.csv")
    assert said.code == 0, said.err
    assert "1200 samples of joint 1 over 6.00 s: position, set point, drive" in " ".join(said.err.split())
    assert f"next: daq check {said.out.strip()} --model MACHINE.toml" in said.err
    Path("spiked.toml").write_text(f'machine = "{SINGLE_AXIS}"\n', "utf-8")
    said = daq("traces", "import", "spiked.csv")
    assert "CHECK" in said.err
    assert "3 spikes" in said.err


# ---- `daq fit --consistent-inertias`, on a machine whose link is a body


ROD = 'link = { mass = "0.8 ± 0.08 kg" }'
MOMENTS = ("link1.inertia_xx", "link1.inertia_yy", "link1.inertia_zz")


def machine(tmp_path: Path, zz: float) -> Path:
    """The single axis with a body: 6 cm thick and 30 cm long, but for the moment about its axis."""

    text = SINGLE_AXIS.read_text("utf-8")
    assert ROD in text
    file = tmp_path / "body.toml"
    file.write_text(
        text.replace(ROD, f"link = {{ mass = 0.8, centre = [-0.15, 0.0, 0.0], inertia = [0.0005, 0.006, {zz}] }}"),
        "utf-8",
    )
    return file


@pytest.fixture
def swing(tmp_path: Path) -> Path:
    """A swing whose rotor is heavier than the model thinks: 0.02 kg·m² more about the axis."""

    def torque(angle: Floats, _speed: Floats, acceleration: Floats) -> Floats:
        return (0.8 * 0.15**2 + 0.006 + 0.004 + 0.02) * acceleration + 0.8 * 9.81 * 0.15 * np.sin(angle)

    return swing_csv(tmp_path / "swing.csv", torque)


@pytest.mark.timeout(300)
def test_a_fit_of_torques_finds_a_body_that_can_exist_and_says_that_it_is_flat(
    daq: CommandLine, tmp_path: Path, swing: Path
) -> None:
    words = ("fit", swing, "--torques", "--machine", machine(tmp_path, 0.006), "--effects", "none")
    found = {}
    for name, options in (("plain", ()), ("consistent", ("--consistent-inertias",))):
        said = daq(*words, "-o", tmp_path / f"{name}.json", "--parameters", "link1.inertia_??", "--json", *options)
        assert json.loads(said.out)["on_the_edge"] == (["link1"] if options else [])
        fitted = load_model(tmp_path / f"{name}.json")
        found[name] = [fitted.parameter(p).value for p in MOMENTS]
    xx, yy, zz = found["plain"]
    assert zz == pytest.approx(0.026, rel=0.02)
    assert xx + yy < zz
    xx, yy, zz = found["consistent"]
    assert zz == pytest.approx(0.026, rel=0.02)
    assert xx + yy > zz
    shown = daq(*words, "-o", tmp_path / "c.json", "--parameters", "link1.inertia_??", "--consistent-inertias")
    assert "link1: flat or thin after the fit; the traces fit a body that cannot exist" in " ".join(shown.out.split())


@pytest.mark.timeout(300)
@pytest.mark.parametrize("torques", [("--torques",), ()])
def test_a_body_that_cannot_exist_and_half_a_choice_are_refused_in_one_line(
    daq: CommandLine, tmp_path: Path, swing: Path, torques: tuple[str, ...]
) -> None:
    def refused(file: Path, parameters: str, *says: str) -> None:
        words = ("fit", swing, *torques, "--machine", file, "-o", tmp_path / "no.json", "--consistent-inertias")
        daq(*words, "--parameters", parameters).complains(2, *says)
        assert not (tmp_path / "no.json").exists()

    refused(machine(tmp_path, 0.02), "link1.mass", "link1: 0.8 kg", "0.0005, 0.006, 0.02", "not physically consistent")
    refused(machine(tmp_path, 0.006), "link1.inertia_zz", "link1.inertia_zz", "fit", "link1.inertia_xx")


# ---- an effect of the user's own, through every command that takes one


AIR_DRAG = ROOT / "examples" / "air_drag.py"
EFFECT_FILE = ("--effect-file", AIR_DRAG)
DRAG, COULOMB, VISCOUS, MASS = 0.015, 0.06, 0.035, 0.87


@pytest.fixture(autouse=True)
def own_library() -> Iterator[None]:
    """A process reads a file once and keeps its effect; here every command is to find an empty library."""
    yield
    forget()


def forget() -> None:
    for name in own_effects():
        remove_own(name)


@pytest.fixture
def dragged_swing(tmp_path: Path) -> Path:
    """An axis dragged by the air: sums of sines, 10 s."""

    def torque(angle: Floats, speed: Floats, acceleration: Floats) -> Floats:
        inertial = (MASS * 0.09 / 3 + 0.0044) * acceleration + MASS * 9.81 * 0.15 * np.sin(angle)
        return inertial + VISCOUS * speed + COULOMB * np.sign(speed) + DRAG * np.abs(speed) * speed

    return swing_csv(tmp_path / "swing.csv", torque, count=2000)


@pytest.fixture
def beginning(dragged_swing: Path) -> Path:
    """Its first second and a half: enough for commands that find no value in it."""
    path = dragged_swing.with_name("beginning.csv")
    path.write_text("\n".join(dragged_swing.read_text().splitlines()[:300]) + "\n")
    return path


@pytest.fixture
def dragged(daq: CommandLine, tmp_path: Path, dragged_swing: Path) -> Path:
    """The model with the user's effect, fitted to the dragged_swing."""
    model = tmp_path / "drag.json"
    effects = ("--effects", "viscous,coulomb,air_drag", "--hold", "controller.delay", "--no-priors")
    said = daq(
        "fit", dragged_swing, "--torques", "--machine", SINGLE_AXIS, "-o", model, "--json", *effects, *EFFECT_FILE
    )
    found = {p["name"]: p["value"] for p in json.loads(said.out)["parameters"]}
    assert found["link1.mass"] == pytest.approx(MASS, rel=0.01)
    assert found["joint1.air_drag.coefficient"] == pytest.approx(DRAG, rel=0.1)
    return model


@pytest.mark.timeout(300)
def test_an_effect_file_is_used_by_fit_and_simulate(daq: CommandLine, dragged: Path, beginning: Path) -> None:
    simulated = daq("simulate", dragged, beginning, "--json", *EFFECT_FILE)
    assert math.isfinite(json.loads(simulated.out)["agreement"]["in_sample"][0]["rmse"])


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_an_effect_file_is_used_by_compare_and_validate(daq: CommandLine, dragged: Path, beginning: Path) -> None:
    compared = json.loads(daq("compare", dragged, SINGLE_AXIS, beginning, "--json", *EFFECT_FILE).out)
    assert "joint1.air_drag.coefficient" in {d["name"] for d in compared["differences"]}
    words = ("validate", dragged, beginning, "--parameters", "*air_drag*", "--json", *EFFECT_FILE)
    assert [p["name"] for p in json.loads(daq(*words).out)["fidelity"]["parameters"]] == ["joint1.air_drag.coefficient"]


def test_a_model_that_leaves_more_than_noise_is_sent_to_a_diagnosis(daq: CommandLine, beginning: Path) -> None:
    """The arm swings against drag that its machine file does not have."""
    words = ("validate", SINGLE_AXIS, beginning, "--parameters", "link1.mass")
    (left,) = json.loads(daq(*words, "--json").out)["fidelity"]["left"]
    assert left["rms"] > 2.0 * left["noise"]
    shown = daq(*words).out
    assert "next: daq diagnose, with the same model and traces" in shown
    assert f"{left['rms'] / left['noise']:.2f}" in shown


def test_a_model_that_needs_an_effect_file_names_it(daq: CommandLine, dragged: Path, beginning: Path) -> None:
    forget()
    daq("simulate", dragged, beginning).complains(2, "air_drag.py", "--effect-file")


@pytest.mark.parametrize(
    ("text", "told"), [(None, "cannot be read"), ("1/0", "ZeroDivisionError"), ("x = 1", "defines no effect")]
)
def test_a_file_without_an_effect_is_refused_in_one_line(
    daq: CommandLine, tmp_path: Path, dragged_swing: Path, text: str | None, told: str
) -> None:
    file = tmp_path / "wrong.py"
    if text is not None:
        file.write_text(text)
    daq("simulate", SINGLE_AXIS, dragged_swing, "--effect-file", file).complains(2, "wrong.py", told)
