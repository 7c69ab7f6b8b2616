"""People and programs with tokens, at a service inside the tests' own process."""

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

import httpx

from daq.contracts.service.queue import Role
from server.access.tokens import TokenStore
from tests.server.migrated import migrated_store

SPEC = {"trajectory": {"kind": "pause", "duration": 0.1}, "joints": [1], "name": "warm-up"}
LATER = "2100-01-01T00:00:00Z"


def tokens_of(folder: Path, people: Mapping[str, Role]) -> dict[str, str]:
    """A token for each of them, in the database of the service that keeps its data in `folder`."""
    store = migrated_store(folder / "service" / "service.sqlite")
    try:
        return {name: TokenStore(store).add(name, role, datetime.now(UTC)) for name, role in people.items()}
    finally:
        store.close()


class Person:
    """Somebody with a token, and what they do."""

    def __init__(self, robot: httpx.Client, token: str) -> None:
        self.robot = robot
        self.headers = {"Authorization": f"Bearer {token}"}

    def ask(self, method: str, path: str, body: object = None, **headers: str) -> httpx.Response:
        """The answer of the robot's API."""
        return self.robot.request(method, path, json=body, headers=self.headers | headers)

    def submit(self, **more: object) -> str:
        """The number of a new experiment, which waits until the year 2100 unless `at` is given."""
        answer = self.ask("POST", "/experiments", {"spec": SPEC, "at": LATER} | more)
        assert answer.status_code == 201, answer.text
        return str(answer.json()["id"])

    def me(self) -> dict[str, object]:
        """Who the service takes them for."""
        found: dict[str, object] = self.robot.get(
            self.robot.base_url.copy_with(path="/api/v1/me"), headers=self.headers
        ).json()
        return found


def people_at(robot: httpx.Client, folder: Path, people: Mapping[str, Role]) -> dict[str, Person]:
    """All of them, by name."""
    return {name: Person(robot, token) for name, token in tokens_of(folder, people).items()}


def kind_of(answer: httpx.Response) -> tuple[int, str]:
    """Status and kind of a refusal."""
    return answer.status_code, str(answer.json()["type"]).partition("#")[2]
