"""No experiment moves a real arm before somebody else has approved exactly what it is."""

import tempfile
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import httpx
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, consumes, invariant, rule
from sqlalchemy import text

from daq.contracts.experiment import ExperimentSpec
from daq.contracts.machine import load_machine
from daq.contracts.service.experiments import Experiment, ExperimentRequest
from server.clock import SystemClock
from server.experiments.review import Given, Review
from server.problems import ProblemError
from server.robot.robot import Robot
from server.store.engine import Store
from server.store.experiments import ExperimentStore, NotApprovedError
from tests.server.access.people import LATER, SPEC, Person, kind_of, people_at, tokens_of
from tests.server.inside import service_inside
from tests.server.migrated import migrated_store
from tests.server.polling import until
from tests.server.queue.bench import REAL

NOW = datetime(2026, 1, 1, tzinfo=UTC)
MACHINE = load_machine("ma2000")
OTHER = MACHINE.model_copy(update={"name": "another"})
REVIEWS = {one.machine: one for one in (Review.of("ma2000", m, "operator") for m in (MACHINE, OTHER))}
PEOPLE = st.sampled_from(["anna", "bert", "olga"])
DURATIONS = st.sampled_from([0.1, 0.2])


def _spec(duration: float) -> ExperimentSpec:
    return ExperimentSpec.model_validate({"trajectory": {"kind": "pause", "duration": duration}, "joints": [1]})


@dataclass
class Known:
    """What is known of an experiment besides the database: who has written what, and who approved which content."""

    authors: set[str]
    duration: float
    approved: tuple[float, str, str] | None = None
    """Of which duration, on which machine, by whom."""


class WhatBegins(RuleBasedStateMachine):
    """Whatever people submit, change, look at, approve and withdraw, also with what they saw of before: what begins is
    what somebody else has approved, on the machine that it begins on."""

    experiments = Bundle("experiments")
    seen = Bundle("seen")

    def __init__(self) -> None:
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.database = migrated_store(Path(self.folder.name) / "service.sqlite")
        self.store = ExperimentStore(self.database)
        self.review = next(iter(REVIEWS.values()))
        self.known: dict[str, Known] = {}

    def teardown(self) -> None:
        self.database.close()
        self.folder.cleanup()

    @rule(target=experiments, by=PEOPLE, duration=DURATIONS)
    def submit(self, by: str, duration: float) -> str:
        """Puts one into the queue."""
        made, _ = self.store.submit("ma2000", ExperimentRequest(spec=_spec(duration)), NOW, by)
        self.known[made.id] = Known({by}, duration)
        return made.id

    @rule(experiment=experiments, by=PEOPLE, duration=DURATIONS)
    def change(self, experiment: str, by: str, duration: float) -> None:
        """Gives it another specification, or the same again, which ends the approval, too."""
        self.store.change("ma2000", experiment, by, None, _spec(duration))
        known = self.known[experiment]
        known.authors, known.duration, known.approved = known.authors & {self._owner(experiment)} | {by}, duration, None

    @rule(target=seen, experiment=experiments)
    def look(self, experiment: str) -> tuple[str, str, float, str]:
        """Somebody sees it as it is now."""
        content = self.review.content(self._get(experiment).content)
        return experiment, content, self.known[experiment].duration, self.review.machine

    @rule(what=seen, by=PEOPLE)
    def approve(self, what: tuple[str, str, float, str], by: str) -> None:
        """Somebody approves what was seen, now or long ago."""
        experiment, content, duration, machine = what
        known = self.known.get(experiment)
        is_same = known is not None and (duration, machine) == (known.duration, self.review.machine)
        if known is None or by in known.authors or not is_same:
            with pytest.raises(ProblemError):
                self.store.approve("ma2000", experiment, self.review, Given(content, by, False), NOW)
        else:
            self.store.approve("ma2000", experiment, self.review, Given(content, by, False), NOW)
            known.approved = (duration, machine, by)

    @rule(experiment=experiments)
    def withdraw(self, experiment: str) -> None:
        """Somebody thinks better of it."""
        self.store.withdraw_approval("ma2000", experiment)
        self.known[experiment].approved = None

    @rule(machine=st.sampled_from(sorted(REVIEWS)), looks=st.booleans())
    def restart(self, machine: str, looks: bool) -> None:
        """The service is started with another machine file, or with the same; without `looks` it fails before it has
        looked at its approvals."""
        self.review = REVIEWS[machine]
        self.store = ExperimentStore(self.database)
        if looks:
            self.store.void_outdated("ma2000", self.review)
            for one in self.known.values():
                if one.approved is not None and one.approved[1] != machine:
                    one.approved = None

    @rule(experiment=consumes(experiments))
    def begin(self, experiment: str) -> None:
        """The queue takes this one, if it may."""
        known = self.known[experiment]
        if known.approved is None or known.approved[:2] != (known.duration, self.review.machine):
            with pytest.raises(NotApprovedError):
                self.store.begin("ma2000", experiment, NOW, self.review)
            self.store.cancel_waiting("ma2000", experiment, NOW, "the test")
        else:
            assert self.store.begin("ma2000", experiment, NOW, self.review).state == "running"
        del self.known[experiment]

    @invariant()
    def approvals_are_told(self) -> None:
        """What is approved is what the service says is."""
        for identity, known in self.known.items():
            approval = self._get(identity).approval
            assert (None if approval is None else approval.by) == (
                None if known.approved is None else known.approved[2]
            )

    def _get(self, identity: str) -> Experiment:
        return self.store.get("ma2000", identity)

    def _owner(self, identity: str) -> str:
        return self._get(identity).owner


WhatBegins.TestCase.settings = settings(max_examples=25, stateful_step_count=25, deadline=None)
test_what_begins_was_approved = WhatBegins.TestCase


@pytest.fixture
def robot(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[httpx.Client]:
    """A service whose experiments another operator must approve. Its mock passes for a real arm; tests in which nothing
    begins do not connect it."""
    seems_real(monkeypatch)
    with service_inside(tmp_path, SystemClock(), monkeypatch, review="operator") as client:
        yield client


@pytest.fixture
def people(robot: httpx.Client, tmp_path: Path) -> dict[str, Person]:
    return people_at(robot, tmp_path, {"anna": "operator", "bert": "operator", "olga": "owner", "vera": "viewer"})


def seems_real(monkeypatch: pytest.MonkeyPatch) -> None:
    def identity(robot: Robot) -> object:
        return (robot._identity or REAL).model_copy(update={"simulated": False})

    monkeypatch.setattr(Robot, "identity", property(identity))


def _content(person: Person, experiment: str) -> str:
    return str(person.ask("GET", f"/experiments/{experiment}").json()["content"])


def _until_it_waits_for(robot: httpx.Client, what: str) -> None:
    until(robot, "/queue", lambda queue: what in queue["waiting_for"])


def _end_of(person: Person, experiment: str) -> dict[str, object]:
    while True:
        found: dict[str, object] = person.ask("GET", f"/experiments/{experiment}?wait=5").json()
        if found["state"] not in ("queued", "running"):
            return found


def test_it_begins_when_somebody_else_has_approved_it_and_says_why_before(people: dict[str, Person]) -> None:
    anna, bert = people["anna"], people["bert"]
    assert anna.ask("POST", "/connect").status_code == 200
    assert anna.ask("POST", "/queue/resume", {"moves_real_arm": True}).status_code == 200
    identity = anna.submit(at=None)
    _until_it_waits_for(anna.robot, "the approval of 1 experiment by an operator who did not submit it")
    waiting = bert.ask("GET", "/queue/experiments").json()
    assert [(one["id"], one["needs_approval_of"], one["approval"]) for one in waiting] == [(identity, "operator", None)]
    assert bert.ask("POST", "/queue/attend").status_code == 200
    approved = bert.ask("PUT", f"/experiments/{identity}/approval", {"content": waiting[0]["content"]})
    assert approved.json()["approval"]["by"] == "bert"
    ended = _end_of(bert, identity)
    assert (ended["state"], ended["needs_approval_of"]) == ("done", None), ended
    events = bert.ask("GET", f"/events?experiment={identity}").json()["items"]
    assert ("review", "approved", "bert") in [(one["kind"], one["text"], one["actor"]) for one in events]


def test_one_that_is_not_approved_holds_up_no_other(people: dict[str, Person]) -> None:
    anna, bert = people["anna"], people["bert"]
    assert anna.ask("POST", "/connect").status_code == 200
    first, second = anna.submit(at=None, priority=10), anna.submit(at=None)
    bert.ask("PUT", f"/experiments/{second}/approval", {"content": _content(bert, second)})
    anna.ask("POST", "/queue/resume", {"moves_real_arm": True})
    assert _end_of(anna, second)["state"] == "done"
    assert anna.ask("GET", f"/experiments/{first}").json()["state"] == "queued"


def test_nobody_approves_their_own_nor_without_the_role(people: dict[str, Person]) -> None:
    anna = people["anna"]
    identity = anna.submit()
    body = {"content": _content(anna, identity)}
    path = f"/experiments/{identity}/approval"
    assert kind_of(anna.ask("PUT", path, body)) == (403, "own-experiment")
    assert kind_of(people["vera"].ask("PUT", path, body)) == (403, "operator-needed")
    assert kind_of(people["bert"].ask("PUT", path, {"content": "0" * 64})) == (409, "content-changed")
    assert kind_of(people["bert"].ask("PUT", path, {})) == (422, "not-valid")


def test_nobody_approves_without_a_token_what_they_may_have_submitted_with_one(
    people: dict[str, Person], robot: httpx.Client
) -> None:
    anna = people["anna"]
    identity = anna.submit()
    assert robot.get(f"{robot.base_url.copy_with(path='/api/v1/me')}").json()["is_known"] is False, "the page asks this"
    body = {"content": _content(anna, identity)}
    assert kind_of(robot.put(f"/experiments/{identity}/approval", json=body)) == (403, "own-experiment")
    every = anna.ask("POST", "/schedules", {"spec": SPEC, "every": 86400, "starts": LATER}).json()
    body = {"content": every["content"]}
    assert kind_of(robot.put(f"/schedules/{every['id']}/approval", json=body)) == (403, "own-experiment")
    assert anna.ask("GET", f"/experiments/{identity}").json()["approval"] is None


def test_a_change_ends_the_approval_and_whoever_changed_it_cannot_give_it(people: dict[str, Person]) -> None:
    anna, bert, olga = people["anna"], people["bert"], people["olga"]
    identity = anna.submit()
    path, before = f"/experiments/{identity}/approval", _content(bert, identity)
    assert bert.ask("PUT", path, {"content": before}).json()["needs_approval_of"] is None
    assert anna.ask("PATCH", f"/experiments/{identity}", {"priority": 3}).json()["approval"]["by"] == "bert"
    longer = SPEC | {"trajectory": {"kind": "pause", "duration": 0.2}}
    changed = olga.ask("PATCH", f"/experiments/{identity}", {"spec": longer}).json()
    assert (changed["approval"], changed["needs_approval_of"]) == (None, "operator")
    assert changed["content"] != before
    assert (changed["owner"], changed["changed_by"]) == ("anna", "olga")
    assert kind_of(bert.ask("PUT", path, {"content": before})) == (409, "content-changed")
    assert kind_of(olga.ask("PUT", path, {"content": changed["content"]})) == (403, "own-experiment")
    assert bert.ask("PUT", path, {"content": changed["content"]}).status_code == 200
    assert anna.ask("DELETE", path).json()["approval"] is None
    beyond = SPEC | {"trajectory": {"kind": "ramp", "amplitude": 3.0}}
    assert kind_of(anna.ask("PATCH", f"/experiments/{identity}", {"spec": beyond}))[0] == 422
    assert kind_of(anna.ask("PATCH", f"/experiments/{identity}", {})) == (422, "not-valid")


def test_an_approval_survives_a_restart_unless_the_machine_is_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seems_real(monkeypatch)
    tokens = tokens_of(tmp_path, {"anna": "operator", "bert": "operator"})
    with service_inside(tmp_path, SystemClock(), monkeypatch, review="operator") as robot:
        anna, bert = Person(robot, tokens["anna"]), Person(robot, tokens["bert"])
        identity = anna.submit()
        every = anna.ask("POST", "/schedules", {"spec": SPEC, "every": 86400, "starts": LATER}).json()
        bert.ask("PUT", f"/experiments/{identity}/approval", {"content": _content(bert, identity)})
        bert.ask("PUT", f"/schedules/{every['id']}/approval", {"content": every["content"]})
    with service_inside(tmp_path, SystemClock(), monkeypatch, review="operator") as robot:
        bert = Person(robot, tokens["bert"])
        assert bert.ask("GET", f"/experiments/{identity}").json()["approval"]["by"] == "bert"
        assert bert.ask("GET", f"/schedules/{every['id']}").json()["approval"]["by"] == "bert"
    limits = {"reach": 5.0}
    with service_inside(tmp_path, SystemClock(), monkeypatch, review="operator", limits=limits) as robot:
        robot.post("/connect")
        bert = Person(robot, tokens["bert"])
        found = bert.ask("GET", f"/experiments/{identity}").json()
        assert (found["approval"], found["needs_approval_of"]) == (None, "operator")
        assert bert.ask("GET", f"/schedules/{every['id']}").json()["approval"] is None
        texts = [one["text"] for one in bert.ask("GET", "/events").json()["items"]]
        assert "approval of bert ended: the experiment or the machine file is another one now" in texts


def test_what_was_changed_in_the_database_does_not_begin(people: dict[str, Person], tmp_path: Path) -> None:
    anna, bert = people["anna"], people["bert"]
    identity = anna.submit(at=None)
    bert.ask("PUT", f"/experiments/{identity}/approval", {"content": _content(bert, identity)})
    with closing(Store(tmp_path / "service" / "service.sqlite")) as store, store.writing() as session:
        session.execute(text("UPDATE experiments SET spec = json_set(spec, '$.trajectory.duration', 0.3)"))
    assert anna.ask("POST", "/connect").status_code == 200
    anna.ask("POST", "/queue/resume", {"moves_real_arm": True})
    _until_it_waits_for(anna.robot, "the approval of 1 experiment")
    assert anna.ask("GET", f"/experiments/{identity}").json()["approval"] is None


def test_runs_of_a_schedule_have_its_approval(people: dict[str, Person]) -> None:
    anna, bert = people["anna"], people["bert"]
    every = anna.ask("POST", "/schedules", {"spec": SPEC, "every": 86400, "starts": LATER}).json()
    assert every["needs_approval_of"] == "operator"
    path = f"/schedules/{every['id']}/approval"
    assert kind_of(anna.ask("PUT", path, {"content": every["content"]})) == (403, "own-experiment")
    assert bert.ask("PUT", path, {"content": every["content"]}).json()["needs_approval_of"] is None
    now = anna.ask("POST", "/schedules", {"spec": SPEC, "every": 86400, "starts": "2100-01-01T05:00:00Z"}).json()
    assert now["approval"] is None, "another schedule of the same is another one"
    assert bert.ask("DELETE", path).json()["approval"] is None


def test_an_arm_may_need_an_owner_s_approval(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    seems_real(monkeypatch)
    with service_inside(tmp_path, SystemClock(), monkeypatch, review="owner") as robot:
        people = people_at(robot, tmp_path, {"anna": "operator", "bert": "operator", "olga": "owner"})
        identity = people["anna"].submit()
        path = f"/experiments/{identity}/approval"
        for name in ("bert", "olga"):
            found = people[name].ask("GET", f"/experiments/{identity}").json()
            assert found["needs_approval_of"] == "owner", name
        assert kind_of(people["bert"].ask("PUT", path, {"content": found["content"]})) == (403, "owner-needed")
        approved = people["olga"].ask("PUT", path, {"content": found["content"]})
        assert approved.json()["approval"]["as_owner"] is True


def test_a_simulated_arm_needs_none_and_a_service_without_review_takes_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with service_inside(tmp_path / "a", SystemClock(), monkeypatch, review="operator") as robot:
        robot.post("/connect")
        made = robot.post("/experiments", json={"spec": SPEC}).json()
        assert made["needs_approval_of"] is None
        until(robot, f"/experiments/{made['id']}?wait=5", lambda found: found["state"] == "done")
    with service_inside(tmp_path / "b", SystemClock(), monkeypatch) as robot:
        made = robot.post("/experiments", json={"spec": SPEC, "at": LATER}).json()
        answer = robot.put(f"/experiments/{made['id']}/approval", json={"content": "0" * 64})
        assert kind_of(answer) == (409, "no-review")
