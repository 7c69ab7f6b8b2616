"""How the documents reach a browser, as the built site and as pages that are made from them."""

import asyncio
import re
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI
from starlette.datastructures import MutableHeaders

from daq.config.documents import documents
from server.access.headers import SECURITY, secure
from server.app import bare_app
from server.site import SITE_POLICY, serve_site
from tests.repository.tracked import ROOT

POLICY = "Content-Security-Policy"


@pytest.fixture
def index(tmp_path: Path) -> Path:
    """A site of two pages and a script."""
    site = tmp_path / "site"
    (site / "how-to").mkdir(parents=True)
    (site / "how-to" / "index.html").write_text("<!doctype html><p>how to")
    (site / "site.js").write_text("let found;")
    (tmp_path / "secret.txt").write_text("of somebody else")
    (site / "index.html").write_text("<!doctype html><p>first")
    return site / "index.html"


def get(index: Path | None, path: str, **headers: str) -> httpx.Response:
    """The answer of a server of this site alone."""
    app = FastAPI(docs_url=None)
    serve_site(app, index)
    return asked(app, path, **headers)


def asked(app: FastAPI, path: str, **headers: str) -> httpx.Response:
    """The answer of an application that runs in no process of its own."""

    async def answer() -> httpx.Response:
        transport = httpx.ASGITransport(app)
        async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
            return await client.get(path, headers=headers)

    return asyncio.run(answer())


def test_the_address_without_a_slash_leads_to_the_first_page(index: Path) -> None:
    answer = get(index, "/docs")
    assert answer.next_request is not None
    assert str(answer.next_request.url) == "http://localhost/docs/"
    first = get(index, "/docs/")
    assert (first.status_code, first.text) == (200, "<!doctype html><p>first")
    assert get(index, "/docs/how-to/").text == "<!doctype html><p>how to"


def test_browsers_ask_again_and_are_told_that_nothing_has_changed(index: Path) -> None:
    first = get(index, "/docs/site.js")
    assert first.headers["content-type"].startswith("text/javascript")
    assert first.headers["cache-control"] == "no-cache"
    again = get(index, "/docs/site.js", **{"If-None-Match": first.headers["etag"]})
    assert (again.status_code, again.content) == (304, b"")


def test_a_page_may_send_its_search_and_nothing_else_that_the_dashboard_may_not(index: Path) -> None:
    headers = MutableHeaders(get(index, "/docs/").headers)
    secure(headers, "/docs/", "http://localhost:8301")
    rules, own = ({*policy.split("; ")} for policy in (SECURITY[POLICY], headers[POLICY]))
    assert headers[POLICY] == SITE_POLICY
    assert own - rules == {"form-action 'self'"}
    assert rules - own == {"form-action 'none'"}
    assert "unsafe" not in headers[POLICY]
    assert headers["X-Content-Type-Options"] == "nosniff"


@pytest.mark.parametrize("path", ["/docs/../secret.txt", "/docs/%2e%2e/secret.txt", "/docs/nothing.html"])
def test_nothing_beside_the_site_is_served(index: Path, path: str) -> None:
    assert get(index, path).status_code == 404


def test_where_the_site_is_not_built_the_pages_are_made_from_the_documents() -> None:
    answers = {path: get(None, f"/docs/{path}") for path in ("", "glossary.html", "documents.css", "images/ramp.png")}
    assert {path: answer.status_code for path, answer in answers.items()} == dict.fromkeys(answers, 200)
    assert "<h1" in answers[""].text
    assert answers["images/ramp.png"].headers["content-type"] == "image/png"
    for answer in answers.values():
        assert (answer.headers[POLICY], answer.headers["cache-control"]) == (SITE_POLICY, "no-cache")
    for path in ("nothing.html", "conf.py", "../README.md", "%2e%2e/pyproject.toml", "trial/worlds-1.csv"):
        assert get(None, f"/docs/{path}").status_code == 404


def test_every_link_of_the_pages_that_are_made_here_leads_somewhere(tmp_path: Path) -> None:
    documents().write(tmp_path)
    pages = {page: page.read_text("utf-8") for page in tmp_path.rglob("*.html")}
    assert {path.relative_to(ROOT / "docs").with_suffix(".html") for path in (ROOT / "docs").glob("*.md")} <= {
        page.relative_to(tmp_path) for page in pages
    }
    lost = []
    for page, text in pages.items():
        assert not re.search(r"<(script|style)|<[^>]+ (style|on\w+)=", text), "the policy allows nothing inside a page"
        for href in re.findall(r'(?:href|src)="(?![a-z]+:)([^"]+)"', text):
            path, _, anchor = href.partition("#")
            target = (page.parent / path).resolve() if path else page
            if not target.is_file() or (anchor and f' id="{anchor}"' not in pages[target]):
                lost.append(f"{page.relative_to(tmp_path)}: {href}")
    assert lost == []


def test_the_service_has_both_the_site_and_the_api_s_page() -> None:
    app = bare_app(None)
    leads = asked(app, "/docs").headers["location"]
    answers = {path: asked(app, path).status_code for path in ("/api/docs", "/docs/")}
    assert leads == "docs/"
    assert answers["/api/docs"] in (307, 503)  # it leads to the reference, or says that none is built
    assert answers["/docs/"] == 200
    assert asked(app, "/no-docs").status_code == 404
