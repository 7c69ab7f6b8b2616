"""A batch by Slurm's own commands, of which we have none: stand-ins take what sbatch is given, and run it here."""

import csv
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.extras.lab.batches.traces import folder_of_traces

SBATCH = """#!/bin/sh
cp "$1" "$SLURM_STAND_IN/script"
setsid sh "$SLURM_STAND_IN/script" >"$SLURM_STAND_IN/said" 2>&1 &
echo $! >"$SLURM_STAND_IN/4711"
echo "Submitted batch job 4711"
"""
SCANCEL = """#!/bin/sh
echo "$1" >>"$SLURM_STAND_IN/cancelled"
kill -s KILL -- "-$(cat "$SLURM_STAND_IN/$1")"
"""


def commands(folder: Path, **texts: str) -> None:
    folder.mkdir()
    for name, text in texts.items():
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)


def daq(slurm: Path, *words: object) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PATH": f"{slurm}:{os.environ['PATH']}", "SLURM_STAND_IN": str(slurm)}
    command = [sys.executable, "-c", "import daq_cli; daq_cli.main()", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


@pytest.mark.slow
@pytest.mark.timeout(150)
def test_what_sbatch_is_given_computes_the_batch_and_is_cancelled_at_the_end(tmp_path: Path) -> None:
    traces, slurm, out = folder_of_traces(tmp_path / "traces", 3), tmp_path / "slurm", tmp_path / "out"
    commands(slurm, sbatch=SBATCH, scancel=SCANCEL)
    url = "slurm://compute?workers=1&memory=2GB&walltime=00:30:00&account=robotics"
    done = daq(slurm, "batch", "simulate", traces, "--out", out, "--executor", url)
    assert done.returncode == 0, done.stderr
    with (out / "table.csv").open(encoding="utf-8", newline="") as stream:
        assert [row["state"] for row in csv.DictReader(stream)] == ["done"] * 3
    script = (slurm / "script").read_text("utf-8")
    for line in ("#SBATCH -p compute", "#SBATCH -A robotics", "#SBATCH --mem=2G", "#SBATCH -t 00:30:00"):
        assert line in script, script
    assert (slurm / "cancelled").read_text("ascii").split() == ["4711"]


@pytest.mark.slow
def test_an_sbatch_that_is_not_there_is_told_in_one_line(tmp_path: Path) -> None:
    traces, slurm = folder_of_traces(tmp_path / "traces", 1), tmp_path / "slurm"
    commands(slurm)
    words = ("batch", "simulate", traces, "--out", tmp_path / "out", "--executor", "slurm://compute")
    done = daq(slurm, *words)
    assert done.returncode == 3
    assert "there is no sbatch here" in done.stderr.splitlines()[-1]
