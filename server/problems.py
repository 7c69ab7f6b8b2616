"""Errors as application/problem+json: one line about the error, and one with advice."""

from __future__ import annotations

import errno
import logging
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from daq.contracts import exit_codes
from daq.contracts.errors import DaqError
from daq.contracts.frozen import like
from daq.contracts.service.problems import FieldProblem, ProblemDetails
from daq.transport import PortBusyError
from firmware_protocol.invalid import message_of
from server.database_errors import BRING_BACK, DamagedError, advice_of, is_full, line_of

if TYPE_CHECKING:
    from fastapi import FastAPI, Request
    from fastapi.exceptions import RequestValidationError
    from fastapi.responses import JSONResponse
    from sqlalchemy.exc import DatabaseError
    from starlette.exceptions import HTTPException

MEDIA_TYPE = "application/problem+json"
PATH = "/api/v1/problems"
"""The page about all kinds of problems. A problem's type is its anchor there."""
SCHEMA = {"$ref": f"#/components/schemas/{ProblemDetails.__name__}"}
log = logging.getLogger("server")

TITLES = {
    400: "The request cannot be understood",
    401: "A token is needed",
    403: "Not allowed",
    404: "Not found",
    405: "Method not allowed here",
    406: "Not available in that format",
    409: "Not possible now",
    413: "Too large",
    414: "Address too long",
    415: "Format not supported",
    422: "The request is not valid",
    429: "Too many requests",
    431: "Headers too many or too long",
    500: "Internal error",
    503: "Not available",
    507: "Disk full",
}

NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Operating-system error numbers for a full disk."""
NOT_WRITABLE = (errno.EROFS, errno.EIO)
"""Error numbers for a disk that is at most readable: the system makes it read-only after an error."""

NO_FIELD = re.compile(r"(constrained|function)-.*|(dict|list|set|tuple)\[.*\]|\[key\]")
"""Parts of pydantic's error locations that are not fields: the type tried in a union, or the mark of a key."""


class ProblemError(Exception):
    """A request was not carried out. `kind`: the last part of the problem's type."""

    def __init__(
        self,
        status: int,
        kind: str,
        detail: str,
        advice: str = "",
        fields: Sequence[FieldProblem] = (),
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(detail)
        self.status = status
        self.kind = kind
        self.detail = detail
        self.advice = advice
        self.fields = tuple(fields)
        self.headers = dict(headers or {})


def not_found(what: str, advice: str = "") -> ProblemError:
    """Returns a 404: `what` does not exist."""
    return ProblemError(404, "not-found", f"there is no {what}", advice)


def conflict(kind: str, detail: str, advice: str) -> ProblemError:
    """Returns a 409: the request is valid, but not possible now."""
    return ProblemError(409, kind, detail, advice)


def of_error(error: DaqError) -> ProblemError:
    """Returns the problem for an error of this project's other packages."""
    if isinstance(error, PortBusyError):
        return conflict("port-in-use", str(error), "end the other program, then connect again")
    if isinstance(error.__cause__, OSError) and (problem := of_disk(error.__cause__)) is not None:
        return problem
    return of_exit_code(error.exit_code, str(error))


def of_database(error: DatabaseError) -> ProblemError:
    """Returns a 503 that names the table, a 507 if the disk is full."""
    line = line_of(error)
    log.error("database: %s", line)
    if is_full(error):
        return ProblemError(507, "no-room", "the disk of the database is full", "free some space on it")
    return ProblemError(503, "database", f"the database: {line}", advice_of(error))


def of_damage(error: DamagedError) -> ProblemError:
    """Returns a 503 that names the table."""
    log.error("database: %s", error)
    return ProblemError(503, "database", f"the database: {error}", BRING_BACK)


def of_disk(error: OSError) -> ProblemError | None:
    """Returns a 507 if the disk is full, a 503 if it is not writable, and None for other errors."""
    if error.errno not in (*NO_ROOM, *NOT_WRITABLE):
        return None
    log.error("disk: %s", error)
    line = f"the disk: {error.strerror}"
    if error.errno in NO_ROOM:
        return ProblemError(507, "no-room", line, "free some space on it")
    return ProblemError(503, "disk", line, "the operating system's log says why; make it writable, then try again")


def of_exit_code(exit_code: int, line: str) -> ProblemError:
    """Returns the problem for another process's error, from its line and exit code (docs/command-line.md)."""
    if exit_code == exit_codes.WRONG_INPUT:
        return ProblemError(422, "not-valid", line)
    if exit_code == exit_codes.NOT_REACHED:
        return ProblemError(503, "not-reached", line, "check cable and supply, then connect again")
    if exit_code == exit_codes.STOPPED:
        return ProblemError(409, "stopped", line, "reset the robot when it is safe")
    return ProblemError(409, "not-safe", line, "remove the cause, then try again")


def details_of(problem: ProblemError, request_id: str | None = None, base: str = "") -> ProblemDetails:
    """Returns the body of a problem's response. base: prefix of the service's paths."""
    title = TITLES.get(problem.status, "Problem")
    return like(ProblemDetails, problem, type=f"{base}{PATH}#{problem.kind}", title=title, request_id=request_id)


def response(request: Request, problem: ProblemError) -> JSONResponse:
    """Returns the response for a problem."""
    from fastapi.responses import JSONResponse

    state = request.state
    details = details_of(problem, getattr(state, "request_id", None), getattr(state, "prefix", ""))
    return JSONResponse(details.model_dump(mode="json"), problem.status, headers=problem.headers, media_type=MEDIA_TYPE)


def install(app: FastAPI) -> None:
    """Makes `app` respond to every error with a problem."""
    # Imported here, because the stop listener uses this file and starts without web framework and database library.
    from fastapi.exceptions import RequestValidationError
    from sqlalchemy.exc import DatabaseError
    from starlette.exceptions import HTTPException

    @app.exception_handler(ProblemError)
    async def problem(request: Request, error: ProblemError) -> JSONResponse:
        return response(request, error)

    @app.exception_handler(DaqError)
    async def own(request: Request, error: DaqError) -> JSONResponse:
        return response(request, of_error(error))

    @app.exception_handler(RequestValidationError)
    async def not_valid(request: Request, error: RequestValidationError) -> JSONResponse:
        fields = [FieldProblem(field=_where(one), message=_what(one)) for one in error.errors()[:20]]
        detail = _told(fields[0]) if fields else "the request is not valid"
        return response(request, ProblemError(422, "not-valid", detail, "correct what is named", fields))

    @app.exception_handler(HTTPException)
    async def http(request: Request, error: HTTPException) -> JSONResponse:
        kind = {404: "not-found", 405: "no-such-method"}.get(error.status_code, "http")
        path = request.url.path[:100]
        detail = f"{request.method} {path}: {error.detail}"
        advice = "/api/v1/openapi.json lists every address"
        return response(request, ProblemError(error.status_code, kind, detail, advice, (), error.headers))

    @app.exception_handler(DatabaseError)
    async def database(request: Request, error: DatabaseError) -> JSONResponse:
        return response(request, of_database(error))

    @app.exception_handler(DamagedError)
    async def damaged(request: Request, error: DamagedError) -> JSONResponse:
        return response(request, of_damage(error))

    @app.exception_handler(OSError)
    async def disk(request: Request, error: OSError) -> JSONResponse:
        problem = of_disk(error)
        return await fault(request, error) if problem is None else response(request, problem)

    @app.exception_handler(Exception)
    async def fault(request: Request, error: Exception) -> JSONResponse:
        log.exception("fault in %s %s", request.method, request.url.path, exc_info=error)
        detail = f"{type(error).__name__}: an error of this program"
        return response(request, ProblemError(500, "fault", detail, "the log has details under this request's id"))


def field_of(place: Sequence[int | str]) -> str:
    """Returns the name of a field as clients write it, without pydantic's parts for unions, keys and bodies."""
    parts = [str(part) for part in place if part not in ("body", "query", "path", "header")]
    return ".".join(part for part in parts if not NO_FIELD.fullmatch(part)) or "body"


def _where(error: Mapping[str, Any]) -> str:
    # whose location contains the byte's number
    return "body" if error["type"] == "json_invalid" else field_of(error["loc"])


def _told(problem: FieldProblem) -> str:
    # of the whole body, the message says where
    return problem.message if problem.field == "body" else f"{problem.field}: {problem.message}"


def _what(error: Mapping[str, Any]) -> str:
    message = message_of(error)
    given = error.get("input")
    if isinstance(given, str | int | float | bool) and error["type"] != "json_invalid":
        return f"{message} (got {given!r:.80})"
    return message


PROBLEMS: dict[int | str, dict[str, Any]] = {
    status: {"description": TITLES[status], "content": {MEDIA_TYPE: {"schema": SCHEMA}}}
    for status in (400, 401, 403, 404, 409, 413, 422, 429, 503, 507)
}
"""The problems that any route may return, for its `responses`. They refer to the schema, which the description adds
once: from the model itself, FastAPI would build a validator for each problem of every route."""
