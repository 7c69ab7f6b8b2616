"""`daq --help` starts fast because it loads little; which modules it loads is tested, not how long that takes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from daq.contracts.effects import effect_names
from daq.contracts.experiment import parse_joints
from daq.trajectories.presets import PRESETS
from daq_cli.app import completion

NOT_FOR_HELP = {"rich", "pydantic", "pydantic_settings", "numpy", "serial", "mcap", "platformdirs", "zstandard", "yaml"}

ROOT = Path(__file__).parents[2]
PROGRAM = """
import json, sys
sys.argv = ["daq", *{words!r}]
from daq_cli import main
try:
    main()
except SystemExit:
    pass
print(json.dumps(sorted({{name.partition(".")[0] for name in sys.modules}})), file=sys.stderr)
"""


def begun(*words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """The command, ended; the last line of its errors names the packages that it has loaded."""
    command = [sys.executable, "-c", PROGRAM.format(words=list(words))]
    return subprocess.run(command, env=os.environ | environment, check=True, capture_output=True, text=True, timeout=60)


def loaded(run: subprocess.CompletedProcess[str]) -> set[str]:
    return set(json.loads(run.stderr.splitlines()[-1]))


@pytest.mark.parametrize(
    ("words", "not_needed"),
    [
        (("--help",), NOT_FOR_HELP),
        ((), NOT_FOR_HELP),
        (("--version",), {"typer", "click", "pydantic", "numpy"}),
        (("stop",), {"numpy", "mcap", "rich", "serial", "scipy", "matplotlib"}),
    ],
    ids=["help", "nothing", "version", "stop"],
)
def test_no_library_is_loaded_that_only_other_commands_need(words: tuple[str, ...], not_needed: set[str]) -> None:
    """A stop must be quick: no numbers, no traces, no colours."""
    assert loaded(begun(*words)) & not_needed == set()


def test_a_stop_is_asked_for_before_the_command_line_is_loaded() -> None:
    program = """import sys, daq_cli.app.early_stop as early
early.ask()
print('typer' in sys.modules, 'pydantic' in sys.modules)"""
    run = subprocess.run([sys.executable, "-c", program], check=True, capture_output=True, text=True, timeout=60)
    assert run.stdout.split() == ["False", "False"]


def ended(folder: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """The command line, begun by Python in a folder, whose files come first on its path."""
    program = f"import sys; sys.argv = ['daq', *{words!r}]; from daq_cli import main; main()"
    environment = {"PYTHONPATH": str(ROOT), "DAQ_RUNTIME_FOLDER": str(folder / "run")}
    return subprocess.run(
        [sys.executable, "-c", program],
        cwd=folder, env=environment, check=False, capture_output=True, text=True, timeout=60,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["model.py", "server.py", "daq.py"])
def test_a_file_that_hides_a_package_is_one_line_to_the_command_line_too(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text("mine = 1\n")
    done = ended(tmp_path, "fit", "last", "-o", "fitted.json")
    assert (done.returncode, done.stdout) == (2, "")
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"daq: {tmp_path / name}: has the name of the package")


@pytest.mark.parametrize(("name", "said"), [("model.py", "no program here moves"), ("daq.py", "cannot be loaded")])
def test_a_stop_is_sent_or_said_not_to_be_whatever_hides_a_package(tmp_path: Path, name: str, said: str) -> None:
    (tmp_path / name).write_text("mine = 1\n")
    done = ended(tmp_path, "stop")
    assert done.returncode == 2
    assert done.stdout.startswith("NOTHING WAS STOPPED: ")
    assert said in done.stdout
    assert len(done.stderr.splitlines()) == 1


# ---- what the tab key offers, without loading what computes


HEAVY = {"numpy", "scipy", "numba", "matplotlib", "mcap", "sqlalchemy", "fastapi", "mujoco", "pydantic_settings"}


def test_every_preset_joint_and_effect_is_offered() -> None:
    assert tuple(PRESETS) == completion.PRESETS
    assert completion.presets("diagnostic-") == [f"diagnostic-{letter}" for letter in "abcde"]
    assert completion.effects("") == list(effect_names())
    assert completion.effects("backlash,coulomb") == ["backlash,coulomb_friction"]
    assert all(parse_joints(text) for text in completion.JOINTS)


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("daq run preset held", ["held-out"]),
        ("daq run ramp --joints 2", ["2", "2-3"]),
        ("daq fit --effects backlash,visc", ["backlash,viscous_friction"]),
        ("daq traces show kept/", ["kept/1_ramp.mcap", "kept/2_ramp.mcap"]),
        ("daq traces show l", ["last"]),
    ],
)
def test_completion_loads_no_heavy_library(words: str, offered: list[str]) -> None:
    Path("kept").mkdir()
    for number in (1, 2):
        Path(f"kept/{number}_ramp.mcap").touch()
    Path("daq.toml").write_text('[traces]\nfolder = "kept"\n')
    asked = {"_DAQ_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    run = begun(**asked)
    assert sorted(run.stdout.split()) == offered
    assert loaded(run) & HEAVY == set()
