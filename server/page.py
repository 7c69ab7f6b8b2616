"""Serves the files of the dashboard's built page. They are read once; the build has made their compressed forms."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from fastapi import APIRouter, Request, Response
from fastapi.responses import PlainTextResponse, RedirectResponse

FOLDER = Path(__file__).parent / "dashboard" / "dist"
INDEX = "index.html"
REFERENCE = "reference.html"
"""The reference of the API; `/api/docs` leads to it."""
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
"""Content encodings, the smallest first, and the suffixes of the build's files in them."""


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
    """Returns the encodings that the header Accept-Encoding names and does not refuse (`;q=0`)."""
    found = set()
    for one in accepted.lower().split(","):
        name, _, weight = one.partition(";")
        if weight.replace(" ", "") not in ("q=0", "q=0.0", "q=0.00", "q=0.000"):
            found.add(name.strip())
    return found


def is_built(folder: Path = FOLDER) -> bool:
    """Whether the page has been built."""
    return (folder / INDEX).is_file()


def page_router(folder: Path = FOLDER) -> APIRouter:
    """Returns the routes of all files of the page. `/` is its index, and `/api/docs` leads to the reference of the
    API; if the page is not built, both say how to build it."""
    router = APIRouter(include_in_schema=False)
    files = _files(folder) if is_built(folder) else {}

    @router.get("/")
    async def index(request: Request) -> Response:
        if INDEX not in files:
            return PlainTextResponse(NOT_BUILT + "\n", 503)
        return files[INDEX].response(request)

    @router.get("/api/docs")
    async def reference() -> Response:
        if REFERENCE not in files:
            return PlainTextResponse(NOT_BUILT + "\n", 503)
        return RedirectResponse(f"../{REFERENCE}")  # beside its files, which it names by relative addresses

    def add(name: str, file: PageFile) -> None:
        async def get(request: Request) -> Response:
            return file.response(request)

        router.add_api_route(f"/{name}", get, methods=["GET"], name=name)

    for name, file in files.items():
        add(name, file)
    return router


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
