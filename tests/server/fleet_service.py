"""A real service with several mocks, for tests."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx

from daq.contracts.service.experiments import ENDS
from tests.server.service import START_WITHIN, serving


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
def two_arms(folder: Path, seed: int) -> Iterator[FleetService]:
    """A service with two connected mocks, `left` and `right`; everything that it writes lies in `folder`."""
    ports = {name: f"mock://?pty=1&lock_step=1&seed={seed + n}" for n, name in enumerate(("left", "right"))}
    tables = "".join(f'[robots.{name}]\nport = "{port}"\n' for name, port in ports.items())
    (folder / "daq.toml").write_text(f"{tables}[server]\nconnect_at_start = false\n", "utf-8")
    with serving(folder, "serve", "--port", "0") as (process, url):
        service = FleetService(process, url, folder)
        with service.client:
            for name in ports:  # here, so that no mock is left running by a test
                service.post(f"robots/{name}/connect")
            yield service
            for name in ports:
                service.post(f"robots/{name}/disconnect")
