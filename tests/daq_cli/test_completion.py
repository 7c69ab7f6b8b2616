"""What the tab key offers: all there is of presets, effects, joints and traces, without loading what computes."""

import json
import os
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

from daq.contracts.effects import effect_names
from daq.contracts.experiment import parse_joints
from daq.trajectories.presets import PRESETS
from daq_cli.app import completion
from tests.daq_cli.invoke import CommandLine

PROGRAM = """
import json, sys
from daq_cli import main
try:
    main()
except SystemExit:
    pass
print(json.dumps(sorted({name.partition(".")[0] for name in sys.modules})), file=sys.stderr)
"""
HEAVY = {"numpy", "scipy", "numba", "matplotlib", "mcap", "sqlalchemy", "fastapi", "mujoco", "pydantic_settings"}


def test_every_preset_is_offered() -> None:
    assert tuple(PRESETS) == completion.PRESETS
    assert completion.presets("diagnostic-") == [f"diagnostic-{letter}" for letter in "abcde"]


def test_every_effect_is_offered_after_each_comma() -> None:
    assert completion.effects("") == list(effect_names())
    assert completion.effects("backlash,coulomb") == ["backlash,coulomb_friction"]


def test_joints_that_are_offered_are_joints() -> None:
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
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], env=os.environ | asked, check=True, capture_output=True, text=True, timeout=60
    )
    assert sorted(run.stdout.split()) == offered
    assert set(json.loads(run.stderr.splitlines()[-1])) & HEAVY == set()


def test_the_version_is_that_of_the_package(daq: CommandLine) -> None:
    said = daq("--version")
    assert (said.code, said.out) == (0, f"daq {version('ma2000-daq')}\n")
