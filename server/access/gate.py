"""The gate that every request passes: who calls, under which number it is logged."""

from __future__ import annotations

import secrets

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.access.caller import LOCAL


class Gate:
    """Decides who a caller is."""

    def middleware(self, app: ASGIApp) -> ASGIApp:
        """`app` behind this gate."""

        async def guarded(scope: Scope, receive: Receive, send: Send) -> None:
            if scope["type"] not in ("http", "websocket"):
                await app(scope, receive, send)
                return
            state = scope.setdefault("state", {})
            state["request_id"] = request_id = secrets.token_hex(8)
            state["caller"] = LOCAL

            async def numbered(message: Message) -> None:
                if message["type"] == "http.response.start":
                    MutableHeaders(scope=message)["X-Request-Id"] = request_id
                await send(message)

            await app(scope, receive, numbered)

        return guarded
