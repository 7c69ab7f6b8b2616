"""Notes a request and its answer, while both pass."""

from __future__ import annotations

import asyncio
import hashlib
import json
import re
from collections.abc import Callable
from concurrent.futures import Future
from datetime import datetime
from typing import Any, Protocol

from starlette.types import Message, Receive, Scope, Send

from daq.contracts.service.audit import AuditNote, Outcome
from extras.lab.audit.words import content_of, line_of
from extras.lab.audit.writer import AuditWriter

SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
CHANGE_NOTHING = frozenset(["preview_experiment"])
"""POST operations that change nothing."""
COUNTED = frozenset(["renew_control", "attend_queue", "jog_robot", "create_ticket"])
"""Operations that clients repeat all the time: the first has a row, the others are counted."""
COUNTED_REFUSALS = (401, 403, 404, 405, 429)
"""Refusals that anybody can cause without limit: they are counted, too."""
STOPS = frozenset(["stop_robot", "stop_fleet"])
LONGEST_CONTENT = 4096
"""Bytes of a body up to which it is kept unchanged; of a longer one, size and digest are kept."""
LONGEST_ANSWER = 65536
ROW_WITHIN = 1.0
"""Time (s) for which the answer to a change waits for its row. A stop never waits for its row."""
_ROBOT = re.compile(r"/api/v1/robots/([a-z0-9][a-z0-9_-]{0,31})(/|$)")


class Asker(Protocol):
    """Sender of a request, as admitted by the gate."""

    @property
    def name(self) -> str:
        """The name of their token."""
        ...

    @property
    def role(self) -> str:
        """Their role."""
        ...


def asked_request(
    writer: AuditWriter, utc: Callable[[], datetime], scope: Scope, *, with_content: bool
) -> AskedRequest | None:
    """Returns a watch over a request; None for a read-only one.

    `with_content`: whether its body is kept; of a file only the digest is.
    """
    return None if scope["method"] in SAFE_METHODS else AskedRequest(writer, utc(), scope, with_content=with_content)


class AskedRequest:
    """One request. Wrap its `receive` and `send`; the row is noted at the end of the answer."""

    def __init__(self, writer: AuditWriter, at: datetime, scope: Scope, *, with_content: bool) -> None:
        self._writer = writer
        self._scope = scope
        self._with_content = with_content
        self._at = at
        self._body, self._size, self._sha256 = b"", 0, hashlib.sha256()
        self._answer, self._status, self._noted = b"", 500, False

    def receive(self, receive: Receive) -> Receive:
        """Returns `receive`, which also copies the body."""

        async def heard() -> Message:
            message = await receive()
            piece = message.get("body", b"") if message["type"] == "http.request" else b""
            if piece:
                self._size += len(piece)
                self._sha256.update(piece)
            if piece and self._with_content:
                self._body = (self._body + piece)[: LONGEST_CONTENT + 1]
            return message

        return heard

    def send(self, send: Send) -> Send:
        """Returns `send`, which notes the request before the answer's last piece is sent."""

        async def told(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._status = message["status"]
            elif message["type"] == "http.response.body":
                self._answer = (self._answer + message.get("body", b""))[: LONGEST_ANSWER + 1]
                if not message.get("more_body", False):
                    written = self._note()
                    if written is not None and self._action() not in STOPS:
                        # After this time the row comes later: the change has been made, and the client must learn of
                        # it.
                        await asyncio.wait([asyncio.wrap_future(written)], timeout=ROW_WITHIN)
            await send(message)

        return told

    def end(self) -> None:
        """Notes a request without a whole answer: its client was gone, or the service failed."""
        self._note()

    def _note(self) -> Future[None] | None:
        """Notes the request, once. Returns a future of its row; None without a row of its own."""
        action = self._action()
        if self._noted or action in CHANGE_NOTHING:
            return None
        self._noted = True
        note = self._made(action)
        if action in COUNTED or self._status in COUNTED_REFUSALS:
            self._writer.count(note)
            return None
        return self._writer.note(note)

    def _action(self) -> str:
        return str(getattr(self._scope.get("route"), "name", "unknown"))[:64]

    def _made(self, action: str) -> AuditNote:
        scope, answer = self._scope, self._told()
        caller: Asker | None = scope["state"].get("caller")
        robot = _ROBOT.match(scope["path"])
        client = scope.get("client")
        return AuditNote(
            at=self._at,
            actor=None if caller is None else line_of(caller.name)[:200],
            role=None if caller is None else caller.role,
            origin=line_of(client[0])[:200] if client else "unknown",
            action=action,
            request=line_of(f"{scope['method']} {scope['path']}"),
            robot=robot[1] if robot else None,
            subject=_subject(scope, answer),
            outcome=outcome_of(self._status),
            status=self._status,
            detail=_detail(answer),
            content=self._content(),
            request_id=scope["state"].get("request_id"),
        )

    def _content(self) -> str | None:
        if not self._size:
            return None
        said = content_of(self._body) if self._with_content and self._size <= LONGEST_CONTENT else None
        if said is not None:
            return said
        return json.dumps({"sha256": self._sha256.hexdigest(), "size": self._size}, separators=(",", ":"))

    def _told(self) -> dict[str, Any]:
        """Returns the answer, if it is a JSON object."""
        if len(self._answer) > LONGEST_ANSWER:
            return {}
        try:
            answer = json.loads(self._answer)
        except (ValueError, RecursionError):
            return {}
        return answer if isinstance(answer, dict) else {}


def outcome_of(status: int) -> Outcome:
    """Returns the outcome of a request with this answer."""
    return "done" if status < 400 else "refused" if status < 500 else "failed"


def _subject(scope: Scope, answer: dict[str, Any]) -> str | None:
    """Returns the ID or name of the object that was made or changed: from the URL, or else from the answer."""
    named = [value for name, value in scope.get("path_params", {}).items() if name != "robot"]
    made = [one.get("id") for one in answer.get("experiments", []) if isinstance(one, dict)] or [answer.get("id")]
    found = ", ".join(str(one) for one in named or made if one is not None)
    return line_of(found)[:200] or None


def _detail(answer: dict[str, Any]) -> str:
    """Returns why a request was refused, an arm's answer, the name (and times) of an experiment that was added, or the
    kind and name of a computation.

    Of invalid fields it contains only the names: the problem repeats their values, and `content` has those that are no
    secrets.
    """
    if isinstance(answer.get("type"), str) and "detail" in answer:
        fields = [str(one.get("field")) for one in answer.get("fields") or () if isinstance(one, dict)]
        return line_of(f"{answer['type'].rpartition('#')[2]}: {', '.join(fields) or answer['detail']}")
    if isinstance(answer.get("text"), str):
        return line_of(answer["text"])
    if isinstance(request := answer.get("request"), dict):
        return line_of(", ".join(str(one) for one in (request.get("kind"), request.get("name")) if one))
    if not isinstance(spec := answer.get("spec"), dict):
        return ""
    kind = spec["trajectory"]["kind"] if isinstance(spec.get("trajectory"), dict) else ""
    return line_of(", ".join(str(one) for one in (spec.get("name") or kind, answer.get("rule")) if one))
