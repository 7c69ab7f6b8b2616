"""Runs a private service on this computer, for programs and notebooks."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from types import TracebackType
from typing import Self

from daq.child import Child, last_words
from daq.contracts.errors import DaqError, SpecError
from daq.owner.stop_socket import FOLDER_VARIABLE
from daq.transport import MockPort, parse_port_url
from ma2000.running import MOCK

ENDS_WITHIN = 20.0
"""Time (s) for a service to end in good order, including the current run; then it is killed."""
LOG = "service.log"
_OWNED = """
import os, signal, sys, threading

def end_with_owner():
    sys.stdin.read()
    os.kill(os.getpid(), signal.SIGTERM)

threading.Thread(target=end_with_owner, daemon=True).start()
from daq_cli import main
main()
"""
"""`daq` that ends in good order when its standard input does, that is, when the program that started it ends."""


class LocalServiceError(DaqError):
    """The service did not start. The message contains the last line of its log."""


class LocalService:
    """Runs `daq serve` with a mock, only for this computer. `url` is the argument of `ma2000.Client`.

    It ends with the `with` block, by `close()`, or with this program. It uses the default configuration; its database,
    traces and log are in `folder`.
    """

    def __init__(self, folder: Path | str = "lab", port: str = MOCK) -> None:
        """Starts the service and waits until it answers.

        Raises SpecError for a port that is no mock (a service that moves an arm is started by its operator), and for a
        folder with a daq.toml; LocalServiceError if the service does not start.
        """
        if not isinstance(parse_port_url(port), MockPort):
            raise SpecError(f"port {port!r}: a private service runs only on mock://; for an arm, use `daq serve`")
        self.folder = Path(folder)
        if (self.folder / "daq.toml").exists():
            raise SpecError(f"{self.folder}: has a daq.toml: start its service by `daq serve`, or name another folder")
        self._process = _started(self.folder, port)
        self.url = self._process.output.readline().decode().strip()
        if not self.url:
            code = self._process.wait()
            self.close()
            words = last_words((self.folder / LOG).read_text("utf-8", errors="replace"))
            raise LocalServiceError(f"the service did not start (exit code {code}): {words}")

    def __repr__(self) -> str:
        state = "ended" if self._process.code is not None else self.url
        return f"<LocalService {state}, in {self.folder}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the service in good order. May be called twice."""
        self._process.terminate()
        self._process.close(ENDS_WITHIN)


def _started(folder: Path, port: str) -> Child:
    """Raises SpecError for a folder that cannot be made."""
    environment = {
        name: value for name, value in os.environ.items() if name == FOLDER_VARIABLE or not name.startswith("DAQ_")
    }
    environment |= {"DAQ_SERVER__STOP_PORT": "0", "XDG_CONFIG_HOME": str(folder.absolute())}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with (folder / LOG).open("ab") as log:
            command = [sys.executable, "-c", _OWNED, "--port", port, "serve", "--host", "127.0.0.1", "--port", "0"]
            return Child(command, complaints=log, environment=environment, folder=folder)
    except OSError as error:
        raise SpecError(f"{folder}: no folder for a service: {error.strerror}") from error
