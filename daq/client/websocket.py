"""The WebSocket of a live stream. Its library is imported only when a stream is opened, so other clients do not need
it."""

from __future__ import annotations

from contextlib import ExitStack
from typing import TYPE_CHECKING

from daq.client.errors import ServiceNotReachedError
from daq.contracts.extras import require_extra

if TYPE_CHECKING:
    from websockets.exceptions import ConnectionClosed

CLOSE_WITHIN = 2.0
"""Longest wait (s) for the service to confirm the end."""


class WebSocket:
    """An open connection for text messages."""

    def __init__(self, url: str, token: str | None, within: float, largest: int, proxy: str | None) -> None:
        """Opens the connection.

        Args:
            within: longest wait (s) for the service's answer.
            largest: size limit (bytes) of a message.

        Raises ServiceNotReachedError, also if the service refuses this client; MissingExtraError.
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
        """Returns the next text; None if none comes within `timeout` s. Raises ServiceNotReachedError."""
        try:
            return self._socket.recv(timeout)
        except TimeoutError:
            return None
        except self._closed as error:
            raise self._lost(error) from error

    def close(self) -> None:
        """Closes the connection."""
        self._closed_last.close()

    def _lost(self, error: ConnectionClosed) -> ServiceNotReachedError:
        reason = error.rcvd.reason if error.rcvd is not None and error.rcvd.reason else "the connection is lost"
        return ServiceNotReachedError(f"{self._url}: {reason}")
