"""What is happening, as it happens: frames of the service's WebSocket, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from types import TracebackType
from typing import Self
from urllib.request import getproxies, proxy_bypass

import httpx
from pydantic import TypeAdapter, ValidationError
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidProxy, InvalidURI
from websockets.sync.client import ClientConnection, connect

from daq.client.connection import API, CONNECT_WITHIN, Connection, is_loopback
from daq.client.errors import ServiceNotReachedError
from daq.contracts.service.live import LiveFrame, LiveMessage, LiveRequest, SampleRate, Topic
from firmware_protocol.invalid import first_invalid

LARGEST_FRAME = 64 << 20
"""Size limit (bytes) of a frame: the history of an hour fits."""
CLOSE_WITHIN = 2.0
_FRAME: TypeAdapter[LiveFrame] = TypeAdapter(LiveFrame)


class LiveStream:
    """An open stream. Iterate over it for frames; `next_frame` waits no longer than it is told."""

    def __init__(self, connection: Connection, robot: str) -> None:
        """Raises ServiceNotReachedError, also when the service refuses this client."""
        self._url = f"{_websocket(connection.url)}{API}/{robot}/live"
        self._closed_last = ExitStack()
        headers = {} if connection.token is None else {"Authorization": f"Bearer {connection.token}"}
        try:
            self._socket: ClientConnection = self._closed_last.enter_context(
                connect(
                    self._url,
                    additional_headers=headers,
                    open_timeout=CONNECT_WITHIN,
                    close_timeout=CLOSE_WITHIN,
                    max_size=LARGEST_FRAME,
                    compression=None,
                    proxy=proxy_to(connection.url),
                )
            )
        except (OSError, InvalidHandshake, InvalidProxy, InvalidURI, TimeoutError) as error:
            raise ServiceNotReachedError(f"{self._url}: no stream: {error or 'no answer in time'}") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the stream."""
        self._closed_last.close()

    def subscribe(
        self, *topics: Topic, rate: SampleRate | None = None, history: float | None = None, points: int = 1000
    ) -> None:
        """Subscribes to further topics; `rate` samples a second; `history` s of samples at once, in about `points`."""
        self.send(LiveRequest(subscribe=topics, rate=rate, history=history, points=points))

    def unsubscribe(self, *topics: Topic) -> None:
        """Ends the subscription to these topics."""
        self.send(LiveRequest(unsubscribe=topics))

    def send(self, request: LiveRequest) -> None:
        """Whatever the stream takes, such as a jog command. Raises ServiceNotReachedError."""
        try:
            self._socket.send(request.model_dump_json(exclude_none=True))
        except ConnectionClosed as error:
            raise self._lost(error) from error

    def next_frame(self, timeout: float | None = None) -> LiveFrame | None:
        """The next frame; None when none came within `timeout` s. Raises ServiceNotReachedError."""
        try:
            text = self._socket.recv(timeout)
        except TimeoutError:
            return None
        except ConnectionClosed as error:
            raise self._lost(error) from error
        try:
            return _FRAME.validate_json(text, extra="ignore")
        except ValidationError as error:
            line = f"a frame is not as this version's service sends them: {first_invalid(error).message}"
            raise ServiceNotReachedError(f"{self._url}: {line}") from error

    def __iter__(self) -> Iterator[LiveFrame]:
        while (frame := self.next_frame()) is not None:
            yield frame

    def messages(self) -> Iterator[LiveMessage]:
        """The messages of all frames, one by one."""
        for frame in self:
            yield from frame.messages

    def _lost(self, error: ConnectionClosed) -> ServiceNotReachedError:
        reason = error.rcvd.reason if error.rcvd is not None and error.rcvd.reason else "the connection is lost"
        return ServiceNotReachedError(f"{self._url}: {reason}")


def open_stream(
    connection: Connection, robot: str, topics: Iterable[Topic], rate: SampleRate | None, history: float | None
) -> LiveStream:
    """A stream that has asked for something."""
    stream = LiveStream(connection, robot)
    stream.subscribe(*topics, rate=rate, history=history)
    return stream


def proxy_to(url: str) -> str | None:
    """The proxy that the environment names for the service's requests: the stream goes the same way."""
    address = httpx.URL(url)
    if is_loopback(url) or proxy_bypass(address.host):
        return None
    named = getproxies()
    proxy = named.get(address.scheme) or named.get("all")
    return proxy if proxy is None or "://" in proxy else f"http://{proxy}"


def _websocket(url: str) -> str:
    return str(httpx.URL(url).copy_with(scheme="wss" if url.startswith("https") else "ws")).rstrip("/")
