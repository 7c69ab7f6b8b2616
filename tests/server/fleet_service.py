"""A real service with several mocks, for tests."""

import os
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from daq.contracts.service.experiments import ENDS
from tests.server.service import DAQ, END_WITHIN, START_WITHIN


class FleetService:
    """A running service; `url` is its address."""

    def __init__(self, process: subprocess.Popen[bytes], url: str, folder: Path) -> None:
        self.process = process
        self.url = url
        self.folder = folder
        self.client = httpx.Client(base_url=f"{url}/api/v1", timeout=START_WITHIN)

    def get(self, path: str, **query: Any) -> Any:
        """The data at an address."""
        answer = self.client.get(path, params=query)
        assert answer.is_success, answer.text
        return answer.json()

    def post(self, path: str, body: Any = None) -> Any:
        """The data of an answer."""
        answer = self.client.post(path, json=body)
        assert answer.is_success, answer.text
        return answer.json()

    def end_of(self, robot: str, experiment: str) -> dict[str, Any]:
        """Waits until an experiment has ended."""
        while True:
            found: dict[str, Any] = self.get(f"robots/{robot}/experiments/{experiment}", wait=30)
            if found["state"] in ENDS:
                return found


@contextmanager
def fleet_service(folder: Path, ports: Mapping[str, str]) -> Iterator[FleetService]:
    """A service with a robot at each of `ports`, by name; everything that it writes lies in `folder`."""
    tables = "".join(f'[robots.{name}]\nport = "{port}"\n' for name, port in ports.items())
    (folder / "daq.toml").write_text(f"{tables}[server]\nconnect_at_start = false\n", "utf-8")
    environment = {key: value for key, value in os.environ.items() if not key.startswith("DAQ_")}
    environment |= {"DAQ_RUNTIME_FOLDER": str(folder / "run"), "XDG_CONFIG_HOME": str(folder / "configuration")}
    process = subprocess.Popen(
        [*DAQ, "serve", "--port", "0"], cwd=folder, env=environment, stdout=subprocess.PIPE, stderr=None
    )
    try:
        assert process.stdout is not None
        url = process.stdout.readline().decode().strip()
        assert url, f"the service did not start: exit code {process.wait()}"
        service = FleetService(process, url, folder)
        with service.client:
            yield service
    finally:
        process.terminate()
        try:
            process.wait(END_WITHIN)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        if process.stdout is not None:
            process.stdout.close()
