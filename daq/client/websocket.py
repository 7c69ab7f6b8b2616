"""The WebSocket below a live stream. The library is imported when a stream is opened: other clients do without it."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING

from daq.client.errors import ServiceNotReachedError
from daq.contracts.extras import require_extra

if TYPE_CHECKING:
    from websockets.exceptions import ConnectionClosed

CLOSE_WITHIN = 2.0
"""Time (s) that the service has to confirm the end."""


class WebSocket:
    """An open connection for texts."""

    def __init__(self, url: str, token: str | None, within: float, largest: int, proxy: str | None) -> None:
        """Opens the connection.

        Args:
            within: time (s) that the service has to answer.
            largest: limit (bytes) of a text.

        Raises ServiceNotReachedError, also when the service refuses this client; MissingExtraError.
        """
        require_extra("live", "the live stream", "websockets")
        from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidProxy, InvalidURI
        from websockets.sync.client import connect

        self._url = url
        self._closed = ConnectionClosed
        self._closed_last = ExitStack()
        headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        try:
            self._socket = self._closed_last.enter_context(
                connect(
                    url,
                    additional_headers=headers,
                    open_timeout=within,
                    close_timeout=CLOSE_WITHIN,
                    max_size=largest,
                    compression=None,
                    proxy=proxy,
                )
            )
        except (OSError, InvalidHandshake, InvalidProxy, InvalidURI, TimeoutError) as error:
            raise ServiceNotReachedError(f"{url}: no stream: {error or 'no answer in time'}") from error

    def send(self, text: str) -> None:
        """Sends a text. Raises ServiceNotReachedError."""
        try:
            self._socket.send(text)
        except self._closed as error:
            raise self._lost(error) from error

    def receive(self, timeout: float | None) -> str | bytes | None:
        """The next text; None when none came within `timeout` s. Raises ServiceNotReachedError."""
        try:
            return self._socket.recv(timeout)
        except TimeoutError:
            return None
        except self._closed as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Ends the connection."""
        self._closed_last.close()

    def _lost(self, error: ConnectionClosed) -> ServiceNotReachedError:
        reason = error.rcvd.reason if error.rcvd is not None and error.rcvd.reason else "the connection is lost"
        return ServiceNotReachedError(f"{self._url}: {reason}")
