"""Computations in the background, and the models they make."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from daq.client.connection import Connection, Request
from daq.client.experiments import WAIT, new_key
from daq.contracts.errors import SpecError
from daq.contracts.service.experiments import ENDS
from daq.contracts.service.jobs import (
    Job,
    JobKind,
    JobRequest,
    JobState,
    ModelChange,
    ModelDetails,
    ModelEntry,
    ModelParameter,
)


class Jobs:
    """Fits, validations, comparisons, diagnoses."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._path = f"{robot}/jobs"

    def submit(self, request: JobRequest, *, key: str | None = None) -> Job:
        """Begins a computation as soon as a worker is free; a lost answer is asked for again under the same `key`."""
        headers = {"Idempotency-Key": key or new_key()}
        return self._connection.ask(Job, Request("POST", self._path, request, headers=headers, repeatable=True))

    def get(self, job: str) -> Job:
        """The present state of a job."""
        return self._connection.get(Job, f"{self._path}/{job}")

    def list(self, *states: JobState, kind: JobKind | None = None) -> Iterator[Job]:
        """The newest first; all states where none is named."""
        return self._connection.every(Job, self._path, state=states or None, kind=kind)

    def wait(
        self,
        job: str,
        told: Callable[[Job], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
        seconds: float | None = None,
        look_every: float = WAIT,
    ) -> Job:
        """Waits until it has ended; `told` is called with it at least every `look_every` s.

        Raises TimeoutError after `seconds`; it goes on then.
        """
        until = None if seconds is None else clock() + seconds
        while True:
            left = look_every if until is None else max(0.0, min(look_every, until - clock()))
            found = self._connection.get(Job, f"{self._path}/{job}", wait=left, patience=left)
            if told is not None:
                told(found)
            if found.state in ENDS:
                return found
            if until is not None and clock() >= until:
                raise TimeoutError(f"job {job} is {found.state} after {seconds:g} s")

    def cancel(self, job: str) -> Job:
        """Withdraws a waiting job; asks a running one to end."""
        return self._connection.ask(Job, Request("POST", f"{self._path}/{job}/cancel"))

    def result(self, job: str) -> dict[str, Any]:
        """The result of a finished job; the OpenAPI description of the service gives its form by kind of job."""
        return self._connection.get(dict[str, Any], f"{self._path}/{job}/result")

    def download_report(self, job: str, target: Path) -> Path:
        """Downloads a job's report, one page. Raises SpecError when it cannot be written."""
        return _written(self._connection, f"{self._path}/{job}/report.html", target)

    def delete(self, job: str) -> None:
        """An ended job and its result; a model that it made stays."""
        self._connection.do(Request("DELETE", f"{self._path}/{job}"))


class Models:
    """Models that the service keeps, with what they come from."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._path = f"{robot}/models"

    def list(self) -> Iterator[ModelEntry]:
        """The newest first."""
        return self._connection.every(ModelEntry, self._path)

    def get(self, model: str) -> ModelDetails:
        """A model's effects, parameters and ancestors."""
        return self._connection.get(ModelDetails, f"{self._path}/{model}")

    def machine_parameters(self) -> Sequence[ModelParameter]:
        """Parameters of the model that the machine file describes (`machine` in requests)."""
        return self._connection.get(tuple[ModelParameter, ...], f"{self._path}/machine/parameters")

    def upload(self, file: Path, name: str | None = None) -> ModelEntry:
        """Takes in a file as `daq fit` writes it; the same model has the same number, however often it is sent.

        Raises SpecError when the file cannot be read.
        """
        try:
            content = Path(file).read_bytes()
        except OSError as error:
            raise SpecError(f"model {file}: cannot be read: {error.strerror or error}") from error
        request = Request(
            "POST",
            self._path,
            content=content,
            query={"name": name or Path(file).stem},
            headers={"Content-Type": "application/json"},
            repeatable=True,
        )
        return self._connection.ask(ModelEntry, request)

    def download(self, model: str, target: Path) -> Path:
        """Downloads a model's file, for `daq validate` and the like. Raises SpecError when it cannot be written."""
        return _written(self._connection, f"{self._path}/{model}/model.json", target)

    def change(self, model: str, *, name: str | None = None, notes: str | None = None) -> ModelEntry:
        """A new name or notes; what is None stays."""
        body = ModelChange(name=name, notes=notes)
        return self._connection.ask(ModelEntry, Request("PATCH", f"{self._path}/{model}", body))

    def delete(self, model: str) -> None:
        """Deletes a model for good. Refused while another model derives from it."""
        self._connection.do(Request("DELETE", f"{self._path}/{model}"))


def _written(connection: Connection, path: str, target: Path) -> Path:
    try:
        connection.download(path, Path(target))
    except OSError as error:
        raise SpecError(f"{target}: cannot be written: {error.strerror or error}") from error
    return Path(target)
