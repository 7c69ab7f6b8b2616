"""Jobs through Dask, as far as one process shows it; tests/extras/lab/cluster/test_cluster.py has real clusters."""

import json
import subprocess
import sys

import pytest


@pytest.mark.slow
def test_jobs_are_answered_once_with_their_own_errors_and_a_missing_scheduler_is_told_in_one_line() -> None:
    command = [sys.executable, "-m", "tests.extras.lab.batches.one_process_cluster"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    refused = found.pop("refused")
    assert found == {"count": 1, "squares": [0, 1, 4, 9, 16, 25], "failed": "ValueError('3 is none')"}
    assert refused.startswith("executor dask://127.0.0.1:9: no scheduler answers at tcp://127.0.0.1:9: ")
    assert "\n" not in refused
