"""Limits that apply before the caller is known: the number of connections, and the size of a request's address and
headers.

Connections use open files, which the process also needs for stop sockets, database and traces. uvicorn's parser would
store any number of headers before the gate sees the request.
"""

from __future__ import annotations

import asyncio
import json
import time
from http import HTTPStatus

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from server.problems import MEDIA_TYPE, ProblemError, details_of

MOST_CONNECTIONS = 500
"""Most connections: half of the files that a process may open by default (1024); fewer if it may open fewer
(`server.steady`)."""
MOST_HEADERS = 100
"""Most headers of one request. Browsers send about twenty."""
LARGEST_HEAD = 32 << 10
"""Largest size (bytes) of a request's address and headers together."""
LINGER = 1.0
"""Time (s) for which a refused connection may still send."""
LONGEST_ADDRESS = 8 << 10
"""Largest size (bytes) of a request's address (URL): a cursor, a search and all filters need less than 1 kB."""


class Connection(HttpToolsProtocol):
    """uvicorn's connection with the limits above.

    If there are too many connections, an idle one is closed for the new one; if none is idle, the new one is closed. A
    request with too large a head (address and headers) gets a 414 or 431 as soon as this is known, and its connection
    is closed.
    """

    most = MOST_CONNECTIONS
    _refusal: ProblemError | None = None
    _reading_head = False
    _headers = 0
    """Number of headers of this request so far, including trailers."""
    _parsed_head = 0
    """Number of bytes of this request's head that the parser has reported."""
    _received_head = 0
    """Number of bytes received of the head. The parser reports a header only when it is complete."""
    _silent = 0
    """Number of bytes since the parser's last report: it stores a trailer after the body until the trailer is
    complete."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Accepts a connection, or closes one if there are too many."""
        super().connection_made(transport)
        if len(self.connections) > self.most:
            others = (one for one in self.connections if isinstance(one, Connection) and one is not self)
            given_up = next((one for one in others if one.asks_nothing), self)
            self.connections.discard(given_up)
            given_up.transport.abort()

    @property
    def asks_nothing(self) -> bool:
        """Whether no request is in progress."""
        return self.cycle is None or self.cycle.response_complete

    def data_received(self, data: bytes) -> None:
        """Parses data, and refuses too large a head. Data after a refusal is ignored."""
        if self._refusal is not None:
            return
        if self._reading_head:
            self._received_head += len(data)
        self._silent += len(data)
        if max(self._received_head if self._reading_head else 0, self._silent - len(data)) > LARGEST_HEAD:
            self._refusal = _too_large(f"address and headers have more than {LARGEST_HEAD >> 10} kB")
            self.send_400_response("")
            return
        super().data_received(data)

    def on_message_begin(self) -> None:
        """Resets the counts at the start of a request, and notes its arrival time. After that, the request may wait for
        its remaining bytes, for the previous request on this connection, and for a thread."""
        self._silent = 0
        super().on_message_begin()
        self.scope["state"]["arrived"] = time.monotonic()
        self._reading_head, self._headers, self._parsed_head, self._received_head = True, 0, 0, 0

    def on_url(self, url: bytes) -> None:
        """Counts a part of the address. Raises ProblemError, which the parser converts to its own error."""
        super().on_url(url)
        if len(self.url) > LONGEST_ADDRESS:
            line = f"the address has more than {LONGEST_ADDRESS >> 10} kB"
            self._refuse(ProblemError(414, "head-too-large", line, "send a shorter address"))
        self._count(len(url))

    def on_header(self, name: bytes, value: bytes) -> None:
        """Counts a header, or a trailer after the body. Raises as `on_url` does."""
        self._silent = 0
        self._headers += 1
        if self._headers > MOST_HEADERS:
            self._refuse(_too_large(f"a request may have {MOST_HEADERS} headers"))
        self._count(len(name) + len(value))
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """Notes the end of the head."""
        self._reading_head = False
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """Passes on a part of the body."""
        self._silent = 0
        super().on_body(body)

    def send_400_response(self, msg: str) -> None:
        """Sends the refusal if there is one, otherwise uvicorn's answer."""
        if self._refusal is None:
            super().send_400_response(msg)
            return
        content = json.dumps(details_of(self._refusal).model_dump(mode="json")).encode()
        status = HTTPStatus(self._refusal.status)
        head = (
            f"HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: {MEDIA_TYPE}\r\n"
            f"Content-Length: {len(content)}\r\nConnection: close\r\n\r\n"
        )
        self.transport.write(head.encode() + content)
        if self.cycle is not None:
            self.cycle.disconnected = True  # the response to an earlier request can no longer be sent
        # Read and discard data still under way; otherwise the system would discard this response too.
        self.loop.call_later(LINGER, self.transport.close)

    def _count(self, size: int) -> None:
        self._parsed_head += size
        if self._parsed_head > LARGEST_HEAD:
            self._refuse(_too_large(f"address and headers have more than {LARGEST_HEAD >> 10} kB"))

    def _refuse(self, problem: ProblemError) -> None:
        self._refusal = problem
        raise problem


def _too_large(line: str) -> ProblemError:
    return ProblemError(431, "head-too-large", line, "send fewer and shorter headers")
