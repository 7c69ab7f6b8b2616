"""Serves the files of the dashboard. The first request reads all of them; the build has made their compressed forms."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from pathlib import Path

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Match
from starlette.types import Receive, Scope, Send

FOLDER = Path(__file__).parent / "dashboard" / "dist"
INDEX = "index.html"
REFERENCE = "reference.html"
"""The API reference, to which `/api/docs` redirects."""
NOT_BUILT = "the dashboard's page is not built: run `make page` in the source tree (it needs no Node of your own)"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".woff2": "font/woff2",
    ".json": "application/json",
    ".txt": "text/plain; charset=utf-8",
    ".webmanifest": "application/manifest+json",
}
FOREVER = "public, max-age=31536000, immutable"
"""Cache header of files whose name contains the hash of their content."""
ASK_AGAIN = "no-cache"
"""Cache header of all other files: browsers ask each time whether the file has changed."""
PACKINGS = {"br": ".br", "gzip": ".gz"}
"""Content encodings, the smallest first, with the suffixes of the build's files."""


@dataclass(frozen=True)
class PageFile:
    """One file of the page. `packed`: its compressed forms by encoding, the smallest first."""

    content: bytes
    packed: dict[str, bytes]
    media_type: str
    tag: str
    cache: str

    def response(self, request: Request) -> Response:
        """Returns the file in an encoding that the browser accepts; a 304 if the browser has it already."""
        headers = {"Cache-Control": self.cache, "ETag": self.tag, "Vary": "Accept-Encoding"}
        if request.headers.get("if-none-match") == self.tag:
            return Response(status_code=304, headers=headers)
        taken = encodings(request.headers.get("accept-encoding", ""))
        for encoding, packed in self.packed.items():
            if encoding in taken:
                headers["Content-Encoding"] = encoding
                return Response(packed, headers=headers, media_type=self.media_type)
        return Response(self.content, headers=headers, media_type=self.media_type)


def encodings(accepted: str) -> set[str]:
    """Returns the encodings that the header Accept-Encoding lists and does not refuse (`;q=0`)."""
    found = set()
    for one in accepted.lower().split(","):
        name, _, weight = one.partition(";")
        if weight.replace(" ", "") not in ("q=0", "q=0.0", "q=0.00", "q=0.000"):
            found.add(name.strip())
    return found


def is_built(folder: Path = FOLDER) -> bool:
    """Whether the page has been built."""
    return (folder / INDEX).is_file()


class Page(BaseRoute):
    """The routes of all files of the page. `/` is its index, and `/api/docs` redirects to the API reference. If the
    page is not built, both explain how to build it."""

    def __init__(self, folder: Path = FOLDER) -> None:
        self._folder = folder

    @cached_property
    def _found(self) -> dict[str, PageFile]:
        return _files(self._folder) if is_built(self._folder) else {}

    def matches(self, scope: Scope) -> tuple[Match, Scope]:
        """Whether a request is for the page."""
        if scope["type"] != "http" or (
            scope["path"] not in ("/", "/api/docs") and scope["path"][1:] not in self._found
        ):
            return Match.NONE, {}
        return Match.FULL if scope["method"] == "GET" else Match.PARTIAL, {}

    async def handle(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answers with a file. Raises a 405."""
        if scope["method"] != "GET":
            raise HTTPException(405, headers={"Allow": "GET"})
        await self._answer(scope["path"], Request(scope))(scope, receive, send)

    def _answer(self, path: str, request: Request) -> Response:
        wanted = {"/": INDEX, "/api/docs": REFERENCE}.get(path, path[1:])
        if wanted not in self._found:
            return PlainTextResponse(NOT_BUILT + "\n", 503)
        if path == "/api/docs":
            return RedirectResponse(f"../{REFERENCE}")  # beside its files, which it references by relative addresses
        return self._found[wanted].response(request)


def _files(folder: Path) -> dict[str, PageFile]:
    found = {}
    for path in sorted(folder.rglob("*")):
        if path.suffix in TYPES:
            name = path.relative_to(folder).as_posix()
            content = path.read_bytes()
            forms = {name: path.with_name(path.name + ending) for name, ending in PACKINGS.items()}
            found[name] = PageFile(
                content=content,
                packed={name: form.read_bytes() for name, form in forms.items() if form.is_file()},
                media_type=TYPES[path.suffix],
                tag=f'"{sha256(content).hexdigest()[:32]}"',
                cache=FOREVER if name.startswith("assets/") else ASK_AGAIN,
            )
    return found
