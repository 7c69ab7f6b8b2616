"""Taught programs that the service keeps: until they are deleted, whoever has the control and whatever restarts."""

import json
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import text

from daq.teaching.program import Absolute, Program, Wait, load_program
from server.database_errors import DamagedError
from server.problems import ProblemError
from server.store.engine import Store
from server.store.programs import MOST_PROGRAMS, ProgramStore
from tests.daq_cli.invoke import CommandLine
from tests.server.clocks import HandClock
from tests.server.service import Service

ROBOT = "ma2000"


def _program(name: str = "pick", duration: float = 1.0) -> Program:
    return Program(name=name, instructions=(Absolute(angles={1: 3.1}), Wait(duration=duration)))


@pytest.fixture
def clock() -> HandClock:
    return HandClock()


@pytest.fixture
def programs(store: Store) -> ProgramStore:
    return ProgramStore(store)


def _put(
    programs: ProgramStore, clock: HandClock, program: Program, name: str = "", revision: int | None = None
) -> int:
    clock.turn(1)
    return programs.put(ROBOT, name or program.name, program, revision, clock.utc(), "anna").revision


def test_a_program_is_there_after_a_restart(programs: ProgramStore, store: Store, clock: HandClock) -> None:
    _put(programs, clock, _program())
    with closing(Store(store.file)) as again:
        assert ProgramStore(again).get(ROBOT, "pick").program == _program()


def test_a_change_names_the_revision_that_it_changes_and_may_be_asked_for_again(
    programs: ProgramStore, clock: HandClock
) -> None:
    assert _put(programs, clock, _program()) == _put(programs, clock, _program()) == 1
    for _ in range(2):  # the first answer was lost
        assert _put(programs, clock, _program(duration=2), revision=1) == 2
    with pytest.raises(ProblemError, match=r"was changed by anna meanwhile \(revision 2\)"):
        _put(programs, clock, _program(duration=3), revision=1)
    assert programs.get(ROBOT, "pick").program == _program(duration=2)


def test_a_new_program_overwrites_none_and_a_renamed_one_neither(programs: ProgramStore, clock: HandClock) -> None:
    _put(programs, clock, _program())
    _put(programs, clock, _program("place"))
    with pytest.raises(ProblemError, match="there is a program 'pick' already"):
        _put(programs, clock, _program(duration=2))
    with pytest.raises(ProblemError, match="there is a program 'pick' already"):
        _put(programs, clock, _program(duration=2), name="place", revision=1)
    assert _put(programs, clock, _program("stack"), name="place", revision=1) == 2
    assert [entry.name for entry in programs.all(ROBOT)] == ["stack", "pick"]


def test_what_is_gone_or_another_robots_is_not_there(programs: ProgramStore, clock: HandClock) -> None:
    _put(programs, clock, _program())
    with pytest.raises(ProblemError, match="there is no program 'pick'"):
        programs.get("other", "pick")
    programs.remove(ROBOT, "pick")
    with pytest.raises(ProblemError, match="there is no program 'pick'"):
        _put(programs, clock, _program(duration=2), revision=1)
    with pytest.raises(ProblemError, match="there is no program 'pick'"):
        programs.remove(ROBOT, "pick")


def test_there_is_an_end_to_how_many_are_kept(store: Store, clock: HandClock) -> None:
    assert MOST_PROGRAMS == 1000
    programs = ProgramStore(store, most=1)
    _put(programs, clock, _program())
    with pytest.raises(ProblemError, match="there are 1 programs"):
        _put(programs, clock, _program("place"))


def test_a_list_reads_no_programs_and_a_damaged_one_is_told(
    programs: ProgramStore, store: Store, clock: HandClock
) -> None:
    _put(programs, clock, _program())
    (before,) = programs.all(ROBOT)
    for damaged in ("[", "{}", "[]"):
        with store.writing() as session:
            session.execute(text("UPDATE programs SET program = :damaged"), {"damaged": damaged})
        assert programs.all(ROBOT) == (before,)
        with pytest.raises(DamagedError, match="table programs"):
            programs.get(ROBOT, "pick")


@pytest.fixture
def empty(service: Service) -> Service:
    """A service that keeps no program."""
    for one in service.robot.get("/programs").json():
        assert service.robot.delete(f"/programs/{one['name']}").status_code == 204
    return service


def _body(program: Program) -> dict[str, Any]:
    body: dict[str, Any] = program.model_dump(mode="json")
    return body


def test_a_program_is_kept_without_the_control(empty: Service) -> None:
    waits = Program(name="waits", instructions=(Wait(duration=0.1),))
    kept = empty.robot.put("/programs/waits", json=_body(waits))
    assert kept.status_code == 200, kept.text
    assert empty.robot.get("/programs/waits").json() == {"entry": kept.json(), "program": _body(waits)}
    assert [one["name"] for one in empty.robot.get("/programs").json()] == ["waits"]


@pytest.mark.parametrize("name", ["a b", ".a", "-x", "a" * 65])
def test_a_name_that_is_none_is_refused(empty: Service, name: str) -> None:
    answer = empty.robot.put(f"/programs/{name}", json=_body(_program()))
    assert answer.status_code in (404, 422)
    assert empty.robot.get("/programs").json() == []


def test_the_command_line_keeps_lists_fetches_runs_and_deletes(
    empty: Service, here: CommandLine, tmp_path: Path
) -> None:
    at = ("--server", empty.url, "teach")
    file = tmp_path / "waits.json"
    file.write_text(json.dumps({"name": "waits", "instructions": [{"kind": "wait", "duration": 0.1}]}))
    assert here(*at, "programs", "keep", str(file)).out.startswith("waits: 1 instructions, kept at")
    file.write_text(json.dumps({"name": "waits", "instructions": [{"kind": "wait", "duration": 0.2}]}))
    here(*at, "programs", "keep", str(file)).complains(4, "there is a program 'waits' already")
    assert here(*at, "programs", "keep", str(file), "--replace").code == 0
    (found,) = json.loads(here(*at, "programs", "ls", "--json").out)
    assert (found["name"], found["revision"]) == ("waits", 2)
    assert "waits" in here(*at, "programs", "ls").out
    assert here(*at, "programs", "fetch", "waits", "-o", str(tmp_path / "copy.json")).code == 0
    assert load_program(tmp_path / "copy.json").instructions == (Wait(duration=0.2),)
    file.unlink()
    assert "done: 1 instructions" in here(*at, "program", "waits").out
    assert here(*at, "programs", "delete", "waits").code == 0
    here(*at, "program", "waits").complains(2, "there is no program 'waits'")
    here(*at, "program", "no such").complains(2, "there is no such file")
    here("teach", "programs", "ls").complains(2, "a service has")
