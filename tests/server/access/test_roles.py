"""Roles and ownership, through HTTP: who may change and cancel whose experiments."""

from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from server.clock import SystemClock
from tests.server.access.people import SPEC, Person, kind_of, people_at
from tests.server.inside import service_inside
from tests.server.polling import until

PEOPLE = {"vera": "viewer", "anna": "operator", "bert": "operator", "olga": "owner", "ada": "admin"}


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[httpx.Client]:
    """A service whose robot every owner owns."""
    with service_inside(tmp_path, SystemClock(), monkeypatch) as client:
        yield client


@pytest.fixture
def people(robot: httpx.Client, tmp_path: Path) -> dict[str, Person]:
    """One of each role, and a second operator."""
    return people_at(robot, tmp_path, PEOPLE)  # type: ignore[arg-type]


def test_everybody_is_told_their_role_and_their_arms(people: dict[str, Person]) -> None:
    for name, owned in (("vera", []), ("anna", []), ("olga", ["ma2000"]), ("ada", ["ma2000"])):
        assert people[name].me() == {
            "name": name,
            "role": PEOPLE[name],
            "owner_of": owned,
            "is_known": True,
        }


def test_an_experiment_is_changed_and_cancelled_by_its_operator_by_owners_and_by_a_user_of_this_computer(
    robot: httpx.Client, people: dict[str, Person]
) -> None:
    annas = people["anna"].submit()
    for name, kind in (("bert", "owner-needed"), ("vera", "operator-needed")):
        assert kind_of(people[name].ask("PATCH", f"/experiments/{annas}", {"priority": 7})) == (403, kind), name
        assert kind_of(people[name].ask("POST", f"/experiments/{annas}/cancel")) == (403, kind), name
    found = people["anna"].ask("GET", f"/experiments/{annas}").json()
    assert (found["state"], found["priority"], found["owner"]) == ("queued", 0, "anna")
    for name in ("anna", "olga", "ada"):
        annas = people["anna"].submit()
        assert people[name].ask("PATCH", f"/experiments/{annas}", {"priority": -3}).json()["priority"] == -3, name
        assert people[name].ask("POST", f"/experiments/{annas}/cancel").json()["state"] == "cancelled", name
    assert robot.post(f"/experiments/{people['anna'].submit()}/cancel").status_code == 200


def test_a_schedule_has_an_owner_too_and_so_have_its_runs(people: dict[str, Person]) -> None:
    made = people["anna"].ask("POST", "/schedules", {"spec": SPEC, "every": 86400}).json()
    begun = until(people["bert"].robot, f"/experiments?schedule={made['id']}", lambda found: found["items"])
    runs = begun["items"]  # the queue submits it
    assert (runs[0]["owner"], runs[0]["submitted_by"]) == ("anna", f"schedule {made['id']}")
    path = f"/schedules/{made['id']}"
    assert kind_of(people["bert"].ask("PATCH", path, {"active": False})) == (403, "owner-needed")
    assert kind_of(people["bert"].ask("DELETE", path)) == (403, "owner-needed")
    assert people["anna"].ask("PATCH", path, {"active": False}).json()["active"] is False
    assert people["olga"].ask("DELETE", path).status_code == 204


def test_everybody_who_may_look_may_stop(people: dict[str, Person]) -> None:
    for name, person in people.items():
        assert person.ask("POST", "/stop").json()["note"] == "no robot is connected", name


def test_an_arm_may_name_its_owners(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with service_inside(tmp_path, SystemClock(), monkeypatch, owners=("olga",)) as robot:
        people = people_at(robot, tmp_path, {"olga": "owner", "otto": "owner", "ada": "admin", "anna": "operator"})
        annas = people["anna"].submit()
        assert people["otto"].me()["owner_of"] == []
        assert kind_of(people["otto"].ask("POST", f"/experiments/{annas}/cancel")) == (403, "owner-needed")
        assert kind_of(robot.post(f"/experiments/{annas}/cancel")) == (403, "owner-needed")  # a user of this computer
        assert people["olga"].ask("PATCH", f"/experiments/{annas}", {"priority": 1}).status_code == 200
        assert people["ada"].ask("POST", f"/experiments/{annas}/cancel").status_code == 200
