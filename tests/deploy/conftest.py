"""One composition for all files here: starting it takes longer than what is tried on it."""

import re
from collections.abc import Iterator

import httpx
import pytest

from tests.deploy.composition import FILE, Composition, as_processes
from tests.server.polling import reset

MOCK = "mock://?lock_step=1&seed=3"
"""What its arm does depends on no clock, however busy this computer is."""


@pytest.fixture(scope="package")
def composed() -> Iterator[Composition]:
    """The composition, of which nothing runs yet."""
    from tests.extras.lab.postgresql.server import programs  # here: without the extras the tests are still collected

    if programs() is None:
        pytest.skip("needs a PostgreSQL server: apt install postgresql")
    with as_processes({"service": {"DAQ_ROBOT__PORT": MOCK}}) as made:
        yield made


@pytest.fixture(scope="package")
def token(composed: Composition) -> str:
    """An operator's, made as the file's head says, before the service is there."""
    head = FILE.read_text("utf-8").partition("\nname:")[0]
    (command,) = re.findall(r"run --rm service (daq token add .*)", head)
    return composed.run("service", *command.split()).split()[-1]


@pytest.fixture(scope="package")
def running(composed: Composition, token: str) -> Composition:
    """The service of the file and all that it depends on, each started when the file says."""
    composed.start("service")
    composed.until_healthy("service")
    return composed


@pytest.fixture
def api(running: Composition, token: str) -> Iterator[httpx.Client]:
    """The robot's part of the API, its robot connected and its queue open."""
    url = f"http://{running.address('service')}:8300/api/v1/robots/ma2000"
    with httpx.Client(base_url=url, headers={"Authorization": f"Bearer {token}"}, timeout=100) as client:
        client.post("/connect").raise_for_status()
        reset(client).raise_for_status()
        client.post("/queue/resume", json={}).raise_for_status()
        yield client
