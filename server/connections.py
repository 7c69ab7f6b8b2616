"""How many connections the web server holds: whoever can connect, without a token too, does not use up its files.

The stop listener, the stop sockets, the database and the traces need files of the same process.
"""

from __future__ import annotations

import asyncio

from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

MOST_CONNECTIONS = 500
"""Half of the files that a process may open where nobody has said otherwise (1024)."""


class Connection(HttpToolsProtocol):
    """uvicorn's. When there are too many, the newest takes the place of one that asks for nothing at the moment; where
    all of them wait for answers or watch, it is closed."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """As uvicorn's."""
        super().connection_made(transport)
        if len(self.connections) > MOST_CONNECTIONS:
            others = (one for one in self.connections if isinstance(one, Connection) and one is not self)
            given_up = next((one for one in others if one.asks_nothing), self)
            self.connections.discard(given_up)
            given_up.transport.abort()

    @property
    def asks_nothing(self) -> bool:
        """Whether it has not asked yet, or has been answered."""
        return self.cycle is None or self.cycle.response_complete
