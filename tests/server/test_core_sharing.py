"""What the kernel says of the weights of the service's processes."""

import os
from pathlib import Path

import pytest

from server.jobs.shared_workers import worker_processes


@pytest.mark.skipif(not Path("/proc/self/autogroup").exists(), reason="a kernel without automatic groups")
def test_a_worker_s_session_has_a_tenth_of_the_service_s_weight() -> None:
    with worker_processes(1) as workers:
        worker = workers.submit(os.getpid).result()
        assert Path(f"/proc/{worker}/autogroup").read_text("ascii").split()[-1] == "10"
