"""One service for most tests, and one for jobs: starting one costs more than most of them."""

from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from server.store.engine import Store
from tests.daq_cli.invoke import CommandLine
from tests.server.migrated import migrated_store
from tests.server.other_user import other_users_command_line
from tests.server.polling import reset
from tests.server.queue.bench import Bench
from tests.server.service import Service, running_service


@pytest.fixture(scope="package")
def shared_service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service on a mock behind a pseudo-terminal, connected."""
    with running_service(tmp_path_factory.mktemp("service")) as service:
        service.until_connected()
        yield service


@pytest.fixture(scope="package")
def service_of_jobs(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """A service of the tests of jobs: its arm is as its machine file says, and none of the others moves it."""
    with running_service(tmp_path_factory.mktemp("jobs")) as service:
        service.until_connected()
        yield service


@pytest.fixture(scope="module")
def sound_service(service_of_jobs: Service) -> Iterator[Service]:
    """The same, connected while one file's tests need it, its queue open, whatever the tests of another file left."""
    service_of_jobs.until_connected()
    service_of_jobs.robot.post("/queue/resume", json={})
    yield service_of_jobs
    service_of_jobs.robot.post("/disconnect")


@pytest.fixture
def service(shared_service: Service) -> Service:
    """The same, as every test wants to find it: not stopped, nobody in control, the queue open and empty."""
    for one in shared_service.robot.get("/queue/experiments").json():
        shared_service.robot.post(f"/experiments/{one['id']}/cancel")
    reset(shared_service.robot)
    shared_service.robot.post("/queue/resume", json={})
    shared_service.seen.clear()
    return shared_service


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Bench]:
    """A queue that is not yet begun, and not paused."""
    made = Bench(tmp_path)
    yield made
    made.close()


@pytest.fixture
def here(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[CommandLine]:
    """The command of another user, in a folder of their own, who has no configuration."""
    with other_users_command_line(tmp_path, capsys, monkeypatch) as daq:
        yield daq


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with closing(migrated_store(tmp_path / "service.sqlite")) as made:
        yield made
