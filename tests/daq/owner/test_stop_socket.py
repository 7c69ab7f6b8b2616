"""Stops from outside: where stop sockets lie, who may make them; and a run that is killed."""

from __future__ import annotations

import os
import shutil
import socket
from pathlib import Path
from typing import NoReturn

import pytest

from benchmarks.kills import WAYS, Findings, Undisturbed, Way, end_one, undisturbed
from daq.contracts.errors import ReachError
from daq.contracts.machine import load_machine
from daq.owner import stop_socket
from daq.owner.stop_socket import FOLDER_VARIABLE, request_stop, runtime_folders, stop_listener


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    found = tmp_path / "run"
    monkeypatch.setenv(FOLDER_VARIABLE, str(found))
    return found


def test_the_socket_is_there_while_it_listens_and_its_folder_is_the_users_alone(folder: Path) -> None:
    with stop_listener("arm"):
        (path,) = folder.iterdir()
        assert path.name == f"arm-{os.getpid()}.sock"
        assert folder.stat().st_mode & 0o777 == 0o700
    assert not list(folder.iterdir())


def test_a_folder_that_others_can_write_to_is_refused(folder: Path) -> None:
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.raises(ReachError, match=r"must belong to this user"), stop_listener("arm"):
        pass
    assert request_stop() == [], "and nobody there is believed"


def test_a_terminal_without_a_session_finds_what_others_began(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    assert runtime_folders()[-1] == tmp_path / f"ma2000-daq-{os.getuid()}"
    # The other way round: made among the temporary files, looked for with a session
    monkeypatch.delenv(FOLDER_VARIABLE, raising=False)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    among_temporary = tmp_path / f"ma2000-daq-{os.getuid()}"
    among_temporary.mkdir(mode=0o700)
    session = tmp_path / "session"
    session.mkdir()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(session))
    assert {session / "ma2000-daq", among_temporary} <= set(runtime_folders())


@pytest.mark.parametrize("where", ["file/run", "x" * 120], ids=["below a file", "too long"])
def test_a_socket_that_cannot_be_made_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, where: str) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / where))
    with pytest.raises(ReachError, match=f"cannot be made: .*; set {FOLDER_VARIABLE}") as caught, stop_listener("arm"):
        pass
    assert "\n" not in str(caught.value)


def test_a_socket_whose_folder_is_removed_is_made_again(folder: Path) -> None:
    with stop_listener("arm") as listener:
        assert listener.renew() is None
        shutil.rmtree(folder)
        assert not listener.is_there()
        before = listener.renew()
        assert before is not None
        before.close()
        assert (listener.is_there(), listener.path.parent) == (True, folder)
    assert not list(folder.iterdir())


def test_where_its_folder_cannot_be_made_again_it_lies_among_the_temporary_files(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Such as that of a unit of systemd, in which only root makes folders."""
    tmp_path = tmp_path_factory.mktemp("t")  # a socket's path has 107 bytes at most
    monkeypatch.setattr(stop_socket, "ANSWER_TIMEOUT", 0.01)
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    roots = tmp_path / "roots"
    monkeypatch.setenv(FOLDER_VARIABLE, str(roots / "run"))
    with stop_listener("arm") as listener:
        shutil.rmtree(roots)
        roots.write_text("in the way")
        before = listener.renew()
        assert before is not None
        before.close()
        assert listener.problem == ""
        assert [attempt.path for attempt in request_stop()] == [listener.path]
        monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "another"))
        assert request_stop() == [], "each value of the variable has a folder of its own"


def test_a_socket_that_cannot_be_made_again_says_so_until_it_can(
    tmp_path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TMPDIR", str(folder))
    with stop_listener("arm") as listener:
        shutil.rmtree(folder)
        folder.write_text("in the way")
        assert listener.renew() is None
        assert "cannot be made" in listener.problem
        folder.unlink()
        before = listener.renew()
        assert before is not None
        before.close()
        assert (listener.is_there(), listener.problem) == (True, "")


def test_a_socket_waits_for_a_descriptor_where_none_is_left(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def none_left(*_: object) -> NoReturn:
        raise OSError(24, "Too many open files")

    with stop_listener("arm") as listener:
        shutil.rmtree(folder)
        with monkeypatch.context() as meanwhile:
            meanwhile.setattr(socket, "socket", none_left)
            assert listener.renew() is None
        assert "Too many open files" in listener.problem
        before = listener.renew()
        assert before is not None
        before.close()


def test_a_stop_needs_no_room_on_a_disk(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object, **__: object) -> NoReturn:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "open", full)
    assert request_stop() == []


def test_a_process_that_was_killed_or_is_silent_is_told_so(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder.mkdir(mode=0o700)
    with socket.socket(socket.AF_UNIX) as gone:
        gone.bind(str(folder / "arm-1.sock"))
    assert request_stop() == []
    assert not list(folder.iterdir())
    monkeypatch.setattr(stop_socket, "ANSWER_TIMEOUT", 0.01)
    with stop_listener("arm"):
        (attempt,) = request_stop()
    assert (attempt.robot, attempt.answer) == ("arm", None)
    monkeypatch.setattr(stop_socket, "ANSWER_TIMEOUT", 0.01)
    with stop_listener("arm"), stop_listener("arm-2"):
        assert [attempt.robot for attempt in request_stop("arm")] == ["arm"]
        assert [attempt.robot for attempt in request_stop("arm-2")] == ["arm-2"]


def test_an_answer_that_is_none_counts_as_no_answer(folder: Path) -> None:
    with stop_listener("arm") as listener:
        import threading

        def answer_nonsense() -> None:
            listener.socket.setblocking(True)
            connection, _ = listener.socket.accept()
            connection.sendall(b"nonsense\n")
            connection.close()

        thread = threading.Thread(target=answer_nonsense)
        thread.start()
        (attempt,) = request_stop()
        thread.join()
    assert attempt.answer is None


# ---- Ctrl-C and kill -9 of a run in the middle of its record: an excerpt of `python -m benchmarks kills`


@pytest.fixture(scope="module")
def whole() -> Undisturbed:
    """The run that the others are held against."""
    return undisturbed()


@pytest.mark.slow
@pytest.mark.against_the_clock
@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
def test_whatever_ends_a_run_leaves_nothing_running_a_free_port_a_still_arm_and_no_wrong_sample(
    way: Way, whole: Undisturbed
) -> None:
    findings = Findings()
    end_one(way, 0.0, whole, load_machine("ma2000"), findings, recording=True)
    assert findings.wrong == []
    assert findings.samples > 50 or not way.freezes  # of a process that is killed, what was synced is left
    assert "complete" not in next(iter(findings.met))
