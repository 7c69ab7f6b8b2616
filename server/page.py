"""The dashboard's built page: its files, read once, served with the compressed form that the build made of them."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from fastapi import APIRouter, Request, Response
from fastapi.responses import PlainTextResponse

FOLDER = Path(__file__).parent / "dashboard" / "dist"
INDEX = "index.html"
NOT_BUILT = "the dashboard's page is not built: run `make page` in the source tree (it needs no Node of your own)"
TYPES = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".woff2": "font/woff2",
    ".json": "application/json",
    ".webmanifest": "application/manifest+json",
}
FOREVER = "public, max-age=31536000, immutable"
"""For files whose name holds the hash of their content."""
ASK_AGAIN = "no-cache"


@dataclass(frozen=True)
class PageFile:
    """One file of the page. `packed` is its gzip form, where the build made one."""

    content: bytes
    packed: bytes | None
    media_type: str
    tag: str
    cache: str

    def response(self, request: Request) -> Response:
        """The file as this browser takes it; 304 when it has it already."""
        headers = {"Cache-Control": self.cache, "ETag": self.tag, "Vary": "Accept-Encoding"}
        if request.headers.get("if-none-match") == self.tag:
            return Response(status_code=304, headers=headers)
        if self.packed is not None and "gzip" in request.headers.get("accept-encoding", ""):
            headers["Content-Encoding"] = "gzip"
            return Response(self.packed, headers=headers, media_type=self.media_type)
        return Response(self.content, headers=headers, media_type=self.media_type)


def is_built(folder: Path = FOLDER) -> bool:
    """Whether there is a page to serve."""
    return (folder / INDEX).is_file()


def page_router(folder: Path = FOLDER) -> APIRouter:
    """Routes of every file of the page; `/` is its index. Without a built page, `/` says how to build it."""
    router = APIRouter(include_in_schema=False)
    files = _files(folder) if is_built(folder) else {}

    @router.get("/")
    async def index(request: Request) -> Response:
        if INDEX not in files:
            return PlainTextResponse(NOT_BUILT + "\n", 503)
        return files[INDEX].response(request)

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
            packed = path.with_name(f"{path.name}.gz")
            found[name] = PageFile(
                content=content,
                packed=packed.read_bytes() if packed.is_file() else None,
                media_type=TYPES[path.suffix],
                tag=f'"{sha256(content).hexdigest()[:32]}"',
                cache=FOREVER if name.startswith("assets/") else ASK_AGAIN,
            )
    return found
