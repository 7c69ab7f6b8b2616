"""Background jobs, and the models that they make."""

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
    """Fits, validations, comparisons and diagnoses of a robot."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._path = f"{robot}/jobs"

    def submit(self, request: JobRequest, *, key: str | None = None) -> Job:
        """Submits a job. If the answer is lost, the request is repeated with the same `key`, so it runs once."""
        headers = {"Idempotency-Key": key or new_key()}
        return self._connection.ask(Job, Request("POST", self._path, request, headers=headers, repeatable=True))

    def get(self, job: str) -> Job:
        """Returns the present state of a job."""
        return self._connection.get(Job, f"{self._path}/{job}")

    def list(self, *states: JobState, kind: JobKind | None = None) -> Iterator[Job]:
        """Yields jobs, the newest first; of all states if none is given."""
        return self._connection.every(Job, self._path, state=states or None, kind=kind)

    def wait(
        self,
        job: str,
        told: Callable[[Job], None] | None = None,
        clock: Callable[[], float] = time.monotonic,
        seconds: float | None = None,
        look_every: float = WAIT,
    ) -> Job:
        """Waits until the job has ended; calls `told` with it at least every `look_every` s.

        Raises TimeoutError after `seconds`; the job continues then.
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
        """Withdraws a waiting job; requests a running one to end."""
        return self._connection.ask(Job, Request("POST", f"{self._path}/{job}/cancel"))

    def result(self, job: str) -> dict[str, Any]:
        """Returns the result of a finished job; its form by kind of job is in the service's OpenAPI description."""
        return self._connection.get(dict[str, Any], f"{self._path}/{job}/result")

    def download_report(self, job: str, target: Path) -> Path:
        """Downloads a job's report, one page. Raises SpecError if it cannot be written."""
        return _written(self._connection, f"{self._path}/{job}/report.html", target)

    def delete(self, job: str) -> None:
        """Deletes an ended job and its result; a model that it made stays."""
        self._connection.do(Request("DELETE", f"{self._path}/{job}"))


class Models:
    """Models stored by the service, with their origin."""

    def __init__(self, connection: Connection, robot: str) -> None:
        self._connection = connection
        self._path = f"{robot}/models"

    def list(self) -> Iterator[ModelEntry]:
        """Yields models, the newest first."""
        return self._connection.every(ModelEntry, self._path)

    def get(self, model: str) -> ModelDetails:
        """Returns a model's effects, parameters and ancestors."""
        return self._connection.get(ModelDetails, f"{self._path}/{model}")

    def machine_parameters(self) -> Sequence[ModelParameter]:
        """Returns the parameters of the machine file's model (`machine` in requests)."""
        return self._connection.get(tuple[ModelParameter, ...], f"{self._path}/machine/parameters")

    def upload(self, file: Path, name: str | None = None) -> ModelEntry:
        """Uploads a file written by `daq fit`. The same model always has the same ID, so it may be sent repeatedly.

        Raises SpecError if the file cannot be read.
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
        """Downloads a model's file, for commands such as `daq validate`. Raises SpecError if it cannot be written."""
        return _written(self._connection, f"{self._path}/{model}/model.json", target)

    def change(self, model: str, *, name: str | None = None, notes: str | None = None) -> ModelEntry:
        """Changes name or notes; a value of None stays unchanged."""
        body = ModelChange(name=name, notes=notes)
        return self._connection.ask(ModelEntry, Request("PATCH", f"{self._path}/{model}", body))

    def delete(self, model: str) -> None:
        """Deletes a model permanently. Refused while another model derives from it."""
        self._connection.do(Request("DELETE", f"{self._path}/{model}"))


def _written(connection: Connection, path: str, target: Path) -> Path:
    try:
        connection.download(path, Path(target))
    except OSError as error:
        raise SpecError(f"{target}: cannot be written: {error.strerror or error}") from error
    return Path(target)
