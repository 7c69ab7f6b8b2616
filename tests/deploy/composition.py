"""deploy/compose.yaml as plain processes: its commands, environments, ports and order, without containers.

Each container's address is one of the loopback network, so ports are those of the file; its volumes are folders.
The images that are not built here have stand-ins: PostgreSQL is Debian's server, the object store is moto's.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import yaml

from tests.repository.tracked import ROOT

if TYPE_CHECKING:
    from tests.extras.lab.archive.store import ObjectStore

FILE = ROOT / "deploy" / "compose.yaml"
CONTAINERFILE = ROOT / "deploy" / "Containerfile"
OWN_IMAGE = "localhost/ma2000-daq:0.1.0"
SECRETS = {"DATABASE_PASSWORD": "of-a-test", "ARCHIVE_ACCESS_KEY": "AKIDOFATEST", "ARCHIVE_SECRET_KEY": "a-secret"}
RAMP = {"trajectory": {"kind": "ramp", "amplitude": 0.05, "duration": 0.4}, "joints": [2], "settle": 0.2, "hold": 0.2}
"""An experiment of a second."""
ENDS_WITHIN = 30.0


def composition(secrets: Mapping[str, str]) -> dict[str, Any]:
    """The file, with what it takes from its `.env`. Raises KeyError for what is not there, as compose does."""
    text = re.sub(r"\$\{(\w+):\?[^}]*\}", lambda found: secrets[found[1]], FILE.read_text("utf-8"))
    assert "$" not in re.sub(r"(?m)^\s*#.*$", "", text)
    read: dict[str, Any] = yaml.safe_load(text)
    return read


def image() -> dict[str, Any]:
    """What the image's last stage says: ENTRYPOINT, CMD and ENV."""
    last = CONTAINERFILE.read_text("utf-8").rpartition("\nFROM ")[2].replace("\\\n", " ")
    told = dict(re.findall(r"^(ENTRYPOINT|CMD) (\[.*\])$", last, re.MULTILINE))
    environment = re.findall(r"^ENV (.*)$", last, re.MULTILINE)
    return {
        "entrypoint": json.loads(told["ENTRYPOINT"]),
        "command": json.loads(told["CMD"]),
        "environment": dict(word.split("=", 1) for line in environment for word in line.split()),
    }


@dataclass
class Composition:
    """The services that run, by name. `extra` is environment that one service has besides the file's."""

    folder: Path
    services: dict[str, Any]
    network: str
    extra: Mapping[str, Mapping[str, str]]
    ended: ExitStack
    processes: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)
    stores: dict[str, ObjectStore] = field(default_factory=dict)

    def address(self, name: str) -> str:
        """The address of a service."""
        return f"{self.network}.{1 + list(self.services).index(name)}"

    def here(self, name: str, text: str) -> str:
        """A word of the file, of one service, with this computer's addresses and folders."""
        for other in self.services:
            text = re.sub(rf"(?<![\w.-]){other}(?=:\d|')", self.address(other), text)
        text = re.sub(r"(?<![\d.])(0\.0\.0\.0|127\.0\.0\.1)(?![\d.])", self.address(name), text)
        for inside, outside in self.folders(name).items():
            text = re.sub(rf"(?<![\w.]){inside}(?=/|$)", str(outside), text)
        return text.replace("/opt/ma2000-daq/.venv/bin", str(Path(sys.executable).parent)).replace(
            "/opt/ma2000-daq/first_process.py", str(ROOT / "deploy" / "first_process.py")
        )

    def folders(self, name: str) -> dict[str, Path]:
        """The folders that a service may write to: its volumes, which it may share, and its memory."""
        service = self.services[name]
        volumes = dict(reversed(one.split(":")) for one in service.get("volumes", ()))
        memory = {one.partition(":")[0]: f"{name}-memory" for one in service.get("tmpfs", ())}
        found = {inside: self.folder / outside for inside, outside in {**memory, **volumes}.items()}
        for path in found.values():
            path.mkdir(exist_ok=True)
        return found

    def words(self, name: str, command: list[str]) -> list[str]:
        """A command of a service, here."""
        before = [None, *command]
        return [
            self.address(word) if earlier == "--host" else self.here(name, word)
            for earlier, word in zip(before, command, strict=False)
        ]

    def environment(self, name: str) -> dict[str, str]:
        """The environment of a service: the image's, then the file's."""
        kept = {key: value for key, value in os.environ.items() if not key.startswith(("DAQ_", "AWS_"))}
        service = self.services[name]
        own = image()["environment"] if service["image"] == OWN_IMAGE else {}
        given = {key: self.here(name, str(value)) for key, value in {**own, **service.get("environment", {})}.items()}
        given |= self.extra.get(name, {})
        # numba's own tests of what is compiled already: the tests' folder, which other tests have filled.
        given.pop("NUMBA_CACHE_DIR", None)
        from tests.extras.lab.postgresql.server import programs

        path = f"{given.pop('PATH', '')}:{programs()}:{os.environ['PATH']}"
        return {**kept, **given, "PATH": path}

    def run(self, name: str, *command: str) -> str:
        """As `compose run --rm NAME COMMAND`: what it has printed."""
        self._start_needed(name)
        words = self.words(name, [*image()["entrypoint"], *command])
        environment = self.environment(name)
        done = subprocess.run(words, env=environment, cwd=self.folder, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done
        return done.stdout

    def start(self, name: str) -> None:
        """Starts a service, after those that it depends on are as the file wants them."""
        if name in self.processes or name in self.stores:
            return
        self._start_needed(name)
        service = self.services[name]
        if service["image"] == OWN_IMAGE:
            words = self.words(name, [*image()["entrypoint"], *service.get("command", image()["command"])])
            process = subprocess.Popen(words, env=self.environment(name), cwd=self.folder, stdout=subprocess.PIPE)
            self.processes[name] = process
            self.ended.callback(_end, process)
        else:
            self.stores[name] = STAND_INS[service["image"].partition(":")[0]](self, name)

    def _start_needed(self, name: str) -> None:
        for other, how in self.services[name].get("depends_on", {}).items():
            self.start(other)
            self._wait(other, how["condition"])

    def _wait(self, name: str, condition: str) -> None:
        if condition == "service_completed_successfully":
            assert self.processes[name].wait(ENDS_WITHIN) == 0, name
        elif condition == "service_healthy":
            self.until_healthy(name)
        else:
            assert condition == "service_started"

    def until_healthy(self, name: str) -> None:
        """Carries out a service's health check until it succeeds; the test's own time limit ends the wait. Ours says a
        line when it is ready: before that there is nothing to check."""
        process = self.processes.get(name)
        if process is not None and process.stdout is not None and not process.stdout.closed:
            process.stdout.readline()
            process.stdout.close()
        _cmd, *command = self.services[name]["healthcheck"]["test"]
        assert _cmd == "CMD"
        words, environment = self.words(name, command), self.environment(name)
        while subprocess.run(words, env=environment, cwd=self.folder, capture_output=True, check=False).returncode:
            assert process is None or process.poll() is None, f"{name} has ended"

    def end(self, name: str) -> int:
        """As `compose stop NAME`: the exit code."""
        process = self.processes.pop(name)
        process.terminate()
        return process.wait(ENDS_WITHIN)


def _end(process: subprocess.Popen[bytes]) -> None:
    assert process.stdout is not None
    process.stdout.close()
    process.terminate()
    try:
        process.wait(ENDS_WITHIN)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()


def _database(here: Composition, name: str) -> Any:
    """Debian's PostgreSQL, with the user and the database that the image would make."""
    from tests.extras.lab.postgresql.server import programs, running_postgresql

    given = here.services[name]["environment"]
    found = programs()
    assert found is not None
    server = here.ended.enter_context(running_postgresql(found, here.address(name), 5432))
    server.make(given["POSTGRES_USER"], given["POSTGRES_PASSWORD"], given["POSTGRES_DB"])
    return server


def _objects(here: Composition, name: str) -> ObjectStore:
    """moto's server, with the buckets that the folders of the volume stand for."""
    command = here.services[name]["command"]
    _host, _, port = command[command.index("--port") + 1].rpartition(":")
    from tests.extras.lab.archive.store import running_store  # here: without the extras the tests are still collected

    store = here.ended.enter_context(running_store(here.address(name), int(port)))
    for bucket in here.folders(name)["/objects"].iterdir():
        store.client.create_bucket(Bucket=bucket.name)
    return store


STAND_INS: Mapping[str, Callable[[Composition, str], Any]] = {
    "docker.io/library/postgres": _database,
    "docker.io/versity/versitygw": _objects,
}


def ended(api: httpx.Client, path: str) -> dict[str, Any]:
    """Waits until an experiment or a job has ended; the test's own time limit ends the wait."""
    while True:
        found: dict[str, Any] = api.get(path, params={"wait": 30}).json()
        if found["state"] not in ("queued", "running"):
            return found


@contextmanager
def as_processes(extra: Mapping[str, Mapping[str, str]]) -> Iterator[Composition]:
    """The composition of the file, of which nothing runs yet. Sockets' paths must be short."""
    network = f"127.{64 + os.getpid() // 250 % 128}.{1 + os.getpid() % 250}"
    with tempfile.TemporaryDirectory(prefix="compose-", ignore_cleanup_errors=True) as folder, ExitStack() as ended:
        yield Composition(Path(folder), composition(SECRETS)["services"], network, extra, ended)
