"""What a connection may cost before anybody has said who they are: how many there are, and how long a head may be.

The stop listener, the stop sockets, the database and the traces need files of the same process. uvicorn's parser keeps
every header of a request, however many there are, before anything else is asked.
"""

from __future__ import annotations

import asyncio
import json
from http import HTTPStatus

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from server.problems import MEDIA_TYPE, ProblemError, details_of

MOST_CONNECTIONS = 500
"""Half of the files that a process may open where nobody has said otherwise (1024)."""
MOST_HEADERS = 100
"""Of one request. Browsers send some twenty."""
LARGEST_HEAD = 32 << 10
"""Bytes of a request's address and headers together."""
LINGER = 1.0
"""s that a refused connection may go on sending."""
LONGEST_ADDRESS = 8 << 10
"""Bytes of a request's address (URL): a cursor, a search and every filter need less than one kilobyte."""


class Connection(HttpToolsProtocol):
    """uvicorn's, within the limits above.

    When there are too many connections, the newest takes the place of one that asks for nothing at the moment; where
    all of them wait for answers or watch, it is closed. A request whose head is too large is answered with a 414 or 431
    as soon as that is known, and its connection is closed.
    """

    most = MOST_CONNECTIONS
    _refusal: ProblemError | None = None
    _reading_head = False
    _headers = 0
    """So far, of this request; trailers count, too."""
    _head = 0
    """Bytes that the parser has told of this request's head."""
    _untold = 0
    """Bytes of it that came after its beginning, told or not: a header is told when it has ended."""
    _silent = 0
    """Bytes since the parser told of anything: it keeps a trailer after the body until that has ended."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """As uvicorn's."""
        super().connection_made(transport)
        if len(self.connections) > self.most:
            others = (one for one in self.connections if isinstance(one, Connection) and one is not self)
            given_up = next((one for one in others if one.asks_nothing), self)
            self.connections.discard(given_up)
            given_up.transport.abort()

    @property
    def asks_nothing(self) -> bool:
        """Whether it has not asked yet, or has been answered."""
        return self.cycle is None or self.cycle.response_complete

    def data_received(self, data: bytes) -> None:
        """As uvicorn's. A refused request's connection takes nothing more."""
        if self._refusal is not None:
            return
        if self._reading_head:
            self._untold += len(data)
        self._silent += len(data)
        if max(self._untold if self._reading_head else 0, self._silent - len(data)) > LARGEST_HEAD:
            self._refusal = _too_large(f"address and headers have more than {LARGEST_HEAD >> 10} kB")
            self.send_400_response("")
            return
        super().data_received(data)

    def on_message_begin(self) -> None:
        """A request begins."""
        self._silent = 0
        super().on_message_begin()
        self._reading_head, self._headers, self._head, self._untold = True, 0, 0, 0

    def on_url(self, url: bytes) -> None:
        """A part of the address. Raises ProblemError, which the parser turns into an error of its own."""
        super().on_url(url)
        if len(self.url) > LONGEST_ADDRESS:
            line = f"the address has more than {LONGEST_ADDRESS >> 10} kB"
            self._refuse(ProblemError(414, "head-too-large", line, "send a shorter address"))
        self._count(len(url))

    def on_header(self, name: bytes, value: bytes) -> None:
        """A header, or a trailer after the body. Raises as `on_url`."""
        self._silent = 0
        self._headers += 1
        if self._headers > MOST_HEADERS:
            self._refuse(_too_large(f"a request may have {MOST_HEADERS} headers"))
        self._count(len(name) + len(value))
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        """The head has ended."""
        self._reading_head = False
        super().on_headers_complete()

    def on_body(self, body: bytes) -> None:
        """A part of the body."""
        self._silent = 0
        super().on_body(body)

    def send_400_response(self, msg: str) -> None:
        """The refusal, where there is one; else uvicorn's."""
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
            self.cycle.disconnected = True  # whoever works at the answer of a request before has nobody to give it to
        # What is still on its way is taken and thrown away: else the system would throw away the answer with it.
        self.loop.call_later(LINGER, self.transport.close)

    def _count(self, size: int) -> None:
        self._head += size
        if self._head > LARGEST_HEAD:
            self._refuse(_too_large(f"address and headers have more than {LARGEST_HEAD >> 10} kB"))

    def _refuse(self, problem: ProblemError) -> None:
        self._refusal = problem
        raise problem


def _too_large(line: str) -> ProblemError:
    return ProblemError(431, "head-too-large", line, "send fewer and shorter headers")
