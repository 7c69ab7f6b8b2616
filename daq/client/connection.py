"""HTTP requests to the service: typed answers, problems as errors, and repeats of requests that allow them."""

from __future__ import annotations

import ipaddress
import re
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast
from urllib.parse import quote

import httpx
from pydantic import BaseModel, TypeAdapter, ValidationError

from daq.client.errors import ServiceError, ServiceNotReachedError, reason_of
from daq.contracts.errors import SpecError
from daq.contracts.service.base import Page
from daq.contracts.service.problems import ProblemDetails
from daq.contracts.whole_file import replacing
from firmware_protocol.invalid import first_invalid

API = "/api/v1"
CONNECT_WITHIN = 5.0
"""Time-out (s) for connecting."""
ANSWER_WITHIN = 30.0
"""Time-out (s) for the start of an answer, in addition to the time that the request itself may take."""
PAUSES = (0.2, 0.5, 1.0)
"""Pauses (s) before the second, third and fourth attempt of a request that may be repeated."""
LONGEST_PAUSE = 5.0
"""Longest `Retry-After` (s) that is waited for; if it is longer, the refusal is raised."""
PART = 65536
"""Size (bytes) of the parts of a download."""
TOKEN = re.compile(r"[!-~]+")
"""Characters of a token that an HTTP header can carry."""
T = TypeVar("T")
Query = Mapping[str, Any]


@dataclass(frozen=True)
class Request:
    """One request. `path` is relative to the API's; `repeatable`: sending it twice has the same effect as once.
    `patience`: time-out (s) in addition to ANSWER_WITHIN; `within` (s) replaces both."""

    method: str
    path: str
    body: BaseModel | None = None
    content: bytes | Iterator[bytes] | None = None
    query: Query = field(default_factory=dict)
    headers: Mapping[str, str] = field(default_factory=dict)
    repeatable: bool = False
    patience: float = 0.0
    within: float | None = None


class Connection:
    """Connections to a service. Safe to use from any thread; `close` ends them."""

    def __init__(
        self,
        url: str,
        token: str | None = None,
        *,
        transport: httpx.BaseTransport | None = None,
        pause: Callable[[float], None] = time.sleep,
    ) -> None:
        """`transport` and `pause` replace network and waiting in tests. Raises SpecError."""
        self.url = parse_url(url)
        if token is not None and TOKEN.fullmatch(token) is None:
            raise SpecError("token: only ASCII characters without spaces are allowed; `daq token add` shows one")
        self.token = token
        self.pause = pause
        self._http = httpx.Client(
            base_url=f"{self.url}{API}",
            headers={} if token is None else {"Authorization": f"Bearer {token}"},
            timeout=httpx.Timeout(ANSWER_WITHIN, connect=CONNECT_WITHIN),
            transport=transport,
            trust_env=not is_loopback(self.url),  # a proxy cannot reach services of this computer
        )

    def close(self) -> None:
        """Closes all connections."""
        self._http.close()

    def ask(self, answer: type[T], request: Request) -> T:
        """Returns the answer to a request. Raises ServiceError, ServiceNotReachedError."""
        response = self._sent(request)
        try:
            # A newer service may send fields that this client does not know.
            adapter: TypeAdapter[T] = _adapter(cast(Any, answer))
            return adapter.validate_json(response.content, extra="ignore")
        except ValidationError as error:
            first = first_invalid(error)
            line = f"answers, but not as this version's service: {first.where('answer')}: {first.message}"
            raise ServiceNotReachedError(f"{self.url}: {line}") from error

    def do(self, request: Request) -> None:
        """Sends a request without data in the answer. Raises ServiceError, ServiceNotReachedError."""
        self._sent(request)

    def get(self, answer: type[T], path: str, *, patience: float = 0.0, **query: Any) -> T:
        """Sends a GET request, and returns the answer."""
        return self.ask(answer, Request("GET", path, query=_given(query), repeatable=True, patience=patience))

    def every(self, item: type[T], path: str, **query: Any) -> Iterator[T]:
        """Yields all items of a list, page by page."""
        cursor: str | None = None
        while True:
            page: Page[T] = self.get(Page[item], path, **query, cursor=cursor)  # type: ignore[valid-type]
            yield from page.items
            cursor = page.next
            if cursor is None:
                return

    def download(self, path: str, target: Path) -> None:
        """Downloads a file, completely or not at all. Raises OSError if it cannot be written."""
        try:
            with replacing(target) as part, self._http.stream("GET", quote(path)) as response:
                if not response.is_success:  # a redirection, such as a proxy's, is not the file
                    response.read()
                    raise ServiceError(_problem(response))
                with part.open("wb") as stream:
                    for piece in response.iter_bytes(PART):
                        stream.write(piece)
        except httpx.TransportError as error:
            raise ServiceNotReachedError(f"{self.url}: not reached: {reason_of(error)}") from error

    def _sent(self, request: Request) -> httpx.Response:
        """Returns the response; repeats the request while that may help. Raises ServiceError,
        ServiceNotReachedError."""
        pauses = iter(PAUSES if request.repeatable else ())
        while True:
            try:
                response = self._send(request)
            except httpx.TransportError as error:
                if (wait := next(pauses, None)) is None:
                    raise ServiceNotReachedError(f"{self.url}: not reached: {reason_of(error)}") from error
                self.pause(wait)
                continue
            if response.is_success:
                return response
            problem = _problem(response)
            wait = next(pauses, None) if _may_pass(problem) else None
            if wait is None:
                raise ServiceError(problem)
            self.pause(max(wait, min(LONGEST_PAUSE, _retry_after(response))))

    def _send(self, request: Request) -> httpx.Response:
        content, headers = request.content, dict(request.headers)
        within = ANSWER_WITHIN + request.patience if request.within is None else request.within
        if request.body is not None:
            content = request.body.model_dump_json(exclude_none=True).encode()
            headers["Content-Type"] = "application/json"
        return self._http.request(
            request.method,
            quote(request.path),  # a name typed by a user may contain `?`, `#` or `%`
            content=content,
            params=dict(request.query),
            headers=headers,
            timeout=httpx.Timeout(within, connect=min(within, CONNECT_WITHIN)),
        )


def parse_url(text: str) -> str:
    """Returns the address of a service, without a final slash. Raises SpecError."""
    try:
        url = httpx.URL(text)
    except (httpx.InvalidURL, UnicodeError) as error:
        raise SpecError(f"server {text!r}: {error}; write http://host:port") from error
    if url.scheme not in ("http", "https") or not url.host or url.query or url.fragment:
        raise SpecError(f"server {text!r}: is no address of a service; write http://host:port")
    if url.userinfo:
        raise SpecError("server: has a password in it; a service takes a token (DAQ_TOKEN)")
    return text.rstrip("/")


def is_loopback(url: str) -> bool:
    """Whether an address refers to this computer."""
    host = httpx.URL(url).host
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


@cache
def _adapter(answer: Any) -> TypeAdapter[Any]:
    return TypeAdapter(answer)


def _given(query: Query) -> Query:
    return {name: value for name, value in query.items() if value is not None}


def _problem(response: httpx.Response) -> ProblemDetails:
    """Returns the problem in a response; for a response of another program, such as a proxy, its status."""
    try:
        return ProblemDetails.model_validate_json(response.content)
    except ValidationError:
        line = f"{response.request.url}: {response.status_code} {response.reason_phrase}"
        return ProblemDetails(type="#http", title=response.reason_phrase, status=response.status_code, detail=line)


def _may_pass(problem: ProblemDetails) -> bool:
    """Whether the same request may succeed in a moment."""
    return problem.status == 429 or (problem.status == 503 and problem.type.endswith("#database"))


def _retry_after(response: httpx.Response) -> float:
    text = response.headers.get("Retry-After", "")
    return float(text) if text.isdecimal() else 0.0
