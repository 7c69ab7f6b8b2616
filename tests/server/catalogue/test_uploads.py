"""Files that are made to harm their reader: each is one line, and the service goes on as if nothing had been."""

import contextlib
import json
import os
import resource
import signal
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from pathlib import Path
from typing import Any

import httpx
import pytest

from benchmarks.service_process import children
from daq.contracts.machine import load_machine
from model.machine_model.model import Model, base_model
from server.bounded.messages import Limits, ReadModel, ReadUpload
from server.bounded.process import LONGEST_LINE, answer_order
from server.bounded.workers import ExhaustedError, Workers
from server.problems import ProblemError
from tests.daq.traces.damaged_traces import originals, recording
from tests.daq.traces.samples import record
from tests.daq.traces.test_hostile_files import bomb, bomb_of_chunks
from tests.daq.traces.test_scan import foreign, ours
from tests.server.service import Service

MCAP, CSV = {"Content-Type": "application/octet-stream"}, {"Content-Type": "text/csv"}
SOUND = originals()[0].data
TABLE = b"time,set_point_1,position_1\n"
HOSTILE = {
    "no joints": (foreign(ours() | {"joints": ""}), MCAP),
    "record nested deeply": (foreign(ours() | {"record": "[" * 100_000}), MCAP),
    "an operator of 1000 characters": (recording(record(operator="x" * 1000), close=True), MCAP),
    "a chunk of 2⁶⁴−1 bytes inside": (bomb(2**64 - 1, 1000), MCAP),
    "a bomb of 64 MB that says it is small": (bomb(1000, 64 << 20), MCAP),
    "times of ±1e308": (TABLE + b"-1e308,0,0\n1e308,0,0\n", CSV),
    "a row of 10⁶ columns": (TABLE + b"1," * 1_000_000 + b"\n", CSV),
    "a field that does not end": (TABLE + b'0,0,"' + b"x" * 1_000_000, CSV),
    "bytes": (bytes(range(256)) * 100, CSV),
}
"""Every kind of them is in tests/daq/traces; here is that the door refuses them, too."""
LIMITS = Limits(memory=256 << 20, seconds=30.0)


@pytest.mark.parametrize(("content", "kind"), HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_file_is_refused_in_one_line(service: Service, content: bytes, kind: dict[str, str]) -> None:
    """Most need no new process: what is merely wrong leaves its reader as it was."""
    answer = service.robot.post("/traces", content=content, headers=kind)
    assert answer.status_code in (413, 422), answer.text
    problem = answer.json()
    assert problem["type"] in ("/api/v1/problems#not-a-trace", "/api/v1/problems#too-large")
    assert problem["detail"].startswith("upload: ")
    assert len(problem["detail"]) < 400
    assert "\n" not in problem["detail"]
    assert str(service.folder) not in answer.text
    assert not list((service.folder / "traces").glob(".upload-*"))


def test_a_trace_is_kept_byte_for_byte_and_read(service: Service) -> None:
    answer = service.robot.post("/traces", content=SOUND, headers=MCAP)
    assert answer.status_code == 201, answer.text
    trace = f"/traces/{answer.json()['id']}"
    details = service.robot.get(trace).json()
    assert details["entry"]["samples"] == 60
    assert service.robot.get(f"{trace}/data.mcap").content == SOUND
    assert service.robot.delete(trace).status_code == 204


@pytest.fixture
def workers() -> Iterator[Workers]:
    """A process with limits, started when it is needed."""
    made = Workers(LIMITS, 1)
    yield made
    made.close()


def _order(folder: Path, content: bytes, name: str = "upload.mcap") -> ReadUpload:
    path = folder / name
    path.write_bytes(content)
    return ReadUpload(path=path, folder=folder)


def test_what_needs_too_much_memory_is_refused_and_the_next_file_is_read(workers: Workers, tmp_path: Path) -> None:
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    order = _order(tmp_path, bomb_of_chunks(8))
    with contextlib.suppress(ExhaustedError):  # where its end comes by the kernel
        assert workers.ask(order).problem
    assert workers.ask(_order(tmp_path, SOUND)).data["summary"]["samples"] == 60
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 100_000, "kB: it was inflated here"


def test_what_takes_too_long_is_refused(tmp_path: Path) -> None:
    hasty = Workers(Limits(memory=LIMITS.memory, seconds=0.01), 1, start_within=0.0)
    with closing(hasty), pytest.raises(ExhaustedError, match=r"takes more than the 0\.01 s"):
        hasty.ask(_order(tmp_path, SOUND))


def _readers() -> tuple[int, ...]:
    """The processes that read uploads."""
    return tuple(children(os.getpid(), b"server.bounded"))


def test_a_reader_that_is_killed_is_told_and_another_takes_its_place(workers: Workers, tmp_path: Path) -> None:
    assert not workers.ask(_order(tmp_path, SOUND)).problem
    (idle,) = _readers()
    os.kill(idle, signal.SIGSEGV)
    os.waitid(os.P_PID, idle, os.WEXITED | os.WNOWAIT)
    assert not workers.ask(_order(tmp_path, SOUND)).problem
    assert _readers() != (idle,)


def test_a_disk_without_room_is_not_the_files_fault(workers: Workers, tmp_path: Path) -> None:
    order = _order(tmp_path, TABLE + b"0,0.1,0.1\n0.02,0.1,0.1\n", "upload.csv")
    assert not workers.ask(order).problem
    (number,) = _readers()
    resource.prlimit(number, resource.RLIMIT_FSIZE, (100, resource.RLIM_INFINITY))
    for made in tmp_path.glob("*.mcap"):
        made.unlink()
    assert workers.ask(order).no_room


def test_nobody_waits_for_a_reader_once_the_service_ends(tmp_path: Path) -> None:
    workers, pipe = Workers(LIMITS, 1), tmp_path / "upload.csv"
    os.mkfifo(pipe)  # a file that never has an end, and never a beginning
    with ThreadPoolExecutor(2) as threads:
        asked = [threads.submit(workers.ask, ReadUpload(path=pipe, folder=tmp_path)) for _ in range(2)]
        while not _readers():
            pass
        workers.close()
        for one in asked:
            with pytest.raises(ProblemError, match="the service is ending"):
                one.result(30)


def test_an_error_that_nobody_has_foreseen_is_a_line_and_a_traceback_for_the_log() -> None:
    answer = answer_order('{"kind": "nonsense"}', LIMITS)
    assert answer.problem.startswith("cannot be read: ValidationError")
    assert "Traceback" in answer.fault
    assert answer.spent


# ---- models


def _model() -> dict[str, Any]:
    made: dict[str, Any] = json.loads(base_model(load_machine("ma2000")).model_dump_json())
    return made


def _send(service: Service, model: dict[str, Any], name: str) -> httpx.Response:
    return service.robot.post("/models", json=model, params={"name": name})


def test_no_upload_changes_the_model_of_somebody_else(service: Service) -> None:
    """The same numbers with another lineage are another model."""
    plain = _model() | {"values": {"link1.mass": 0.731}}  # numbers that no other test has sent to this service
    first = _send(service, plain, "theirs")
    kept = service.robot.get(f"/models/{first.json()['id']}/model.json").content
    other = _send(service, plain | {"lineage": {"note": "fitted by me", "parent": "0123456789ab"}}, "mine")
    again = _send(service, plain, "mine as well")
    assert (first.status_code, other.status_code, again.status_code) == (201, 201, 200), other.text
    assert again.json() == first.json()
    assert other.json()["id"] != first.json()["id"]
    assert service.robot.get(f"/models/{first.json()['id']}/model.json").content == kept
    details = service.robot.get(f"/models/{first.json()['id']}").json()
    assert {one["name"] for one in details["parameters"]} == set(Model.model_validate(plain).by_name)
    for one in (first, other):
        assert service.robot.delete(f"/models/{one.json()['id']}").status_code == 204


def test_a_model_names_only_traces_that_its_sender_can_see(service: Service) -> None:
    trace = service.robot.post("/traces", content=SOUND, headers=MCAP).json()["id"]
    refused = _send(service, _model() | {"lineage": {"traces": [trace, "no-such-trace"]}}, "x")
    assert (refused.status_code, refused.json()["type"]) == (422, "/api/v1/problems#not-a-model")
    assert refused.json()["detail"] == "lineage.traces: 'no-such-trace' is no trace of this service"
    taken = _send(service, _model() | {"lineage": {"traces": [trace]}}, "x")
    assert taken.json()["traces"] == [trace]
    assert service.robot.delete(f"/traces/{trace}").status_code == 409
    assert service.robot.delete(f"/models/{taken.json()['id']}").status_code == 204
    assert service.robot.delete(f"/traces/{trace}").status_code == 204


HARM: dict[str, bytes] = {
    "nothing": b"",
    "no-model": b"{}",
    "a-list": b"[1]",
    "no-text": b"\xff",
    "brackets": b"[" * 100_000,
    "nested": b'{"effects":' * 900 + b"1" + b"}" * 900,
    "digits": b"9" * 6000,
    "effects": json.dumps(_model() | {"effects": [{"name": "backlash", "joints": [1]}] * 20_000}).encode(),
    "joints": json.dumps(_model() | {"effects": [{"name": "backlash", "joints": [1] * 100_000}]}).encode(),
    "ties": json.dumps(
        _model() | {"ties": {f"t{k}": [f"t{k - 1}" if k else "link1.mass"] for k in range(9999)}}
    ).encode(),
    "mass": json.dumps(_model() | {"values": {"link1.mass": -1e9}}).encode(),
    "note": json.dumps(_model() | {"lineage": {"note": "x" * (1 << 20)}}).encode(),
    "surrogate": json.dumps(_model() | {"lineage": {"note": "\ud800"}}).encode(),
    "program": json.dumps(
        _model() | {"effects": [{"name": "own", "joints": [1], "file": {"name": "own.py"}}]}
    ).encode(),
}


@pytest.mark.parametrize("content", HARM.values(), ids=HARM)
def test_a_model_made_to_do_harm_is_refused_in_one_line(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "model.json"
    path.write_bytes(content)
    answer = answer_order(ReadModel(path=path).model_dump_json(), LIMITS)
    assert 0 < len(answer.problem) <= LONGEST_LINE + 2, answer
    assert (answer.fault, answer.exhausted, "\n" in answer.problem) == ("", False, False)


def test_a_refused_model_is_told_so(service: Service) -> None:
    refused = _send(service, json.loads(HARM["mass"]), "x")
    assert (refused.status_code, refused.json()["type"]) == (422, "/api/v1/problems#not-a-model")
    assert refused.json()["detail"] == "upload: link1.mass = -1000000000.0 kg: allowed are 0.0 to inf"
