"""Live data: frames of the service's WebSocket."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from types import TracebackType
from typing import TYPE_CHECKING, Self
from urllib.parse import quote
from urllib.request import getproxies, proxy_bypass

import httpx
from pydantic import TypeAdapter, ValidationError

from daq.client.connection import API, CONNECT_WITHIN, Connection, is_loopback
from daq.client.errors import ServiceNotReachedError
from daq.contracts.extras import require_extra
from daq.contracts.service.live import LiveFrame, LiveMessage, LiveRequest, SampleRate, Topic
from firmware_protocol.invalid import first_invalid

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


LARGEST_FRAME = 64 << 20
"""Size limit (bytes) of a frame: the history of an hour fits."""
_FRAME: TypeAdapter[LiveFrame] = TypeAdapter(LiveFrame)


class LiveStream:
    """An open stream. Iterate over it for frames; `next_frame` has a time-out."""

    def __init__(self, connection: Connection, robot: str) -> None:
        """Raises ServiceNotReachedError, also if the service refuses this client; MissingExtraError."""
        self._url = f"{_websocket(connection.url)}{API}/{quote(robot)}/live"
        proxy = proxy_to(connection.url)
        self._socket = WebSocket(self._url, connection.token, CONNECT_WITHIN, LARGEST_FRAME, proxy)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Closes the stream."""
        self._socket.close()

    def subscribe(
        self, *topics: Topic, rate: SampleRate | None = None, history: float | None = None, points: int = 1000
    ) -> None:
        """Subscribes to further topics. `rate`: samples per second; `history`: past samples (s) to send at once, in
        about `points` points."""
        self.send(LiveRequest(subscribe=topics, rate=rate, history=history, points=points))

    def unsubscribe(self, *topics: Topic) -> None:
        """Ends the subscription to these topics."""
        self.send(LiveRequest(unsubscribe=topics))

    def send(self, request: LiveRequest) -> None:
        """Sends any message that the stream accepts, such as a jog command. Raises ServiceNotReachedError."""
        self._socket.send(request.model_dump_json(exclude_none=True))

    def next_frame(self, timeout: float | None = None) -> LiveFrame | None:
        """Returns the next frame; None if none comes within `timeout` s. Raises ServiceNotReachedError."""
        text = self._socket.receive(timeout)
        if text is None:
            return None
        try:
            return _FRAME.validate_json(text, extra="ignore")
        except ValidationError as error:
            line = f"a frame does not match this version of the service: {first_invalid(error).message}"
            raise ServiceNotReachedError(f"{self._url}: {line}") from error

    def __iter__(self) -> Iterator[LiveFrame]:
        while (frame := self.next_frame()) is not None:
            yield frame

    def messages(self) -> Iterator[LiveMessage]:
        """Yields the messages of all frames one by one."""
        for frame in self:
            yield from frame.messages


def open_stream(
    connection: Connection, robot: str, topics: Iterable[Topic], rate: SampleRate | None, history: float | None
) -> LiveStream:
    """Opens a stream and subscribes to topics."""
    stream = LiveStream(connection, robot)
    stream.subscribe(*topics, rate=rate, history=history)
    return stream


def proxy_to(url: str) -> str | None:
    """Returns the proxy that the environment sets for the service's requests; the stream uses it too."""
    address = httpx.URL(url)
    if is_loopback(url) or proxy_bypass(address.host):
        return None
    named = getproxies()
    proxy = named.get(address.scheme) or named.get("all")
    return proxy if proxy is None or "://" in proxy else f"http://{proxy}"


def _websocket(url: str) -> str:
    return str(httpx.URL(url).copy_with(scheme="wss" if url.startswith("https") else "ws")).rstrip("/")
