"""The site of the documents: its parts made from the code are whole, and its pages run under the service's policy."""

import json
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path

import pytest
import uvicorn
from fastapi import FastAPI
from playwright.sync_api import ConsoleMessage, expect
from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from server.access.headers import secure
from server.site import serve_site
from tests.gallery.notebooks import NAMES, notebook
from tests.repository.tracked import ROOT
from tests.server.dashboard.browser import WITHOUT_3D, chromium, playwright

DOCS = ROOT / "docs"
INSIDE = """<html><head><style>p { color: red }</style></head><body class="old">
<script>document.body.dataset.theme = "dark";</script><script type="application/json">{"a": 1}</script>
<p style="color: blue" title="a > b">x</p><p class="y" style="color: blue">x &lt;p style="no"&gt;</p>
<p style='color: blue' class='z'>z</p></body></html>"""


class Inside(HTMLParser):
    """Counts what a strict policy forbids inside a page."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.found: list[str] = []
        self.texts: list[str] = []
        self.feed(page.read_text("utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Notes a start tag that holds a script or a style, or that asks somebody else for one."""
        given = dict(attrs)
        self.found += [f"{tag} {name}" for name in given if name == "style" or name.startswith("on")]
        if tag == "style" or (tag == "script" and "src" not in given and given.get("type") != "application/json"):
            self.found.append(tag)
        address = (given.get("src") or (given.get("href") if tag == "link" else None)) or ""
        if address.startswith(("http:", "https:", "//")):
            self.found.append(address)


def test_every_page_key_and_effect_has_its_place_and_meaning() -> None:
    # Every page has a place in the site
    named = set()
    for index in (*DOCS.glob("*/index.md"), DOCS / "index.md", DOCS / "gallery" / "index.md"):
        if index.is_file():
            (tree,) = re.findall(r"^```{toctree}\n(.*?)^```", index.read_text("utf-8"), re.DOTALL | re.MULTILINE)
            entries = [line for line in tree.splitlines() if line and not line.startswith(":")]
            named |= {(index.parent / f"{entry}.md").resolve() for entry in entries}
    pages = {page for page in DOCS.rglob("*.md") if page.parent.name not in ("decisions", "_site")}
    assert pages - named == {DOCS / "index.md"}
    # Every key of the configuration has a meaning
    from docs.extensions import configuration

    page = configuration.page()
    assert "## `[robot.limits]`" in page
    assert "`following_error_time`\n: Time (s)" in page
    assert page.count("\n: ") > 35
    # The page of the mocks effects has their bounds and sizes
    from docs.extensions import mock_effects

    (row,) = (
        line for line in mock_effects.page().splitlines() if line.startswith("| `direction_dependent_friction` |")
    )
    assert "`torque` -50 to 50 N·m, **0** | ± 0.12–3 / 0.6–12 / 0.15–3 |" in row


def test_what_is_inside_a_page_becomes_files_beside_it(tmp_path: Path) -> None:
    from docs.extensions import policy

    page = tmp_path / "how-to" / "page.html"
    page.parent.mkdir()
    page.write_text(INSIDE)
    policy.mend(tmp_path)
    once = page.read_text()
    policy.mend(tmp_path)  # as after a second build, in which the page has not changed
    assert page.read_text() == once
    assert Inside(page).found == []
    text = page.read_text()
    assert 'x &lt;p style="no"&gt;' in text
    assert '<script type="application/json">{"a": 1}</script>' in text
    assert 'title="a > b"' in text
    kept = {path.suffix: path.read_text() for path in (tmp_path / policy.FOLDER).iterdir() if path.name != policy.SHEET}
    assert kept == {".css": "p { color: red }", ".js": 'document.body.dataset.theme = "dark";'}
    (rule,) = (tmp_path / policy.FOLDER / policy.SHEET).read_text().splitlines()
    assert rule.endswith("{ color: blue }")
    name = rule.split(".")[1]
    assert text.count(name) == 3
    assert f"class='{name} z'" in text, "one attribute, since browsers take the first alone"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site as `make docs` builds it; only the notebooks are shown as they are, without being run."""
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-n", "--quiet", "-D", "nb_execution_mode=off"]
    done = subprocess.run(
        [*command, "-d", str(folder / "doctrees"), str(ROOT / "docs"), str(folder / "site")],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder / "site"


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_the_site_is_built_without_a_warning_and_no_page_needs_the_network(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 90
    assert {str(page.relative_to(site)): Inside(page).found for page in pages if Inside(page).found} == {}
    assert {path.relative_to(ROOT / "docs").with_suffix(".html") for path in (ROOT / "docs").glob("*.md")} <= {
        page.relative_to(site) for page in pages
    }
    assert not (ROOT / "docs" / "jupyter_execute").exists()


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_each_notebook_can_be_downloaded_from_its_page_without_outputs(site: Path) -> None:
    for name in NAMES:
        (target,) = re.findall(r'<a href="([^"]+)" download', (site / "gallery" / f"{name}.html").read_text("utf-8"))
        found = json.loads((site / "gallery" / target).read_text("utf-8"))
        own = notebook(name)
        assert [cell["cell_type"] for cell in found["cells"]] == [cell.cell_type for cell in own.cells]
        assert ["".join(cell["source"]) for cell in found["cells"]] == [cell.source for cell in own.cells]
        assert not any(cell.get("outputs") for cell in found["cells"])


@pytest.fixture
def address(site: Path) -> Iterator[str]:
    """The site behind the headers of the service."""
    app = FastAPI(docs_url=None)
    serve_site(app, site / "index.html")

    def with_headers(inner: ASGIApp) -> ASGIApp:
        async def secured(scope: Scope, receive: Receive, send: Send) -> None:
            async def sent(message: Message) -> None:
                if message["type"] == "http.response.start":
                    secure(MutableHeaders(scope=message), scope["path"])
                await send(message)

            await inner(scope, receive, sent)

        return secured

    app.add_middleware(with_headers)
    server = uvicorn.Server(uvicorn.Config(app, port=0, log_level="critical", ws="none"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        thread.join(0.01)
        assert thread.is_alive()
    try:
        yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}/docs/"
    finally:
        server.should_exit = True
        thread.join()


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.timeout(400)
def test_pages_search_and_themes_work_under_the_policy_on_a_phone(address: str) -> None:
    complaints: list[str] = []

    def note(message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            complaints.append(message.text)

    with playwright() as driver, chromium(driver, *WITHOUT_3D) as browser:
        page = browser.new_page(viewport={"width": 375, "height": 800})
        page.on("console", note)
        for name in (
            "",
            "glossary.html",
            "machine-file.html",
            "reference/rest.html",
            "reference/options.html",
            "reference/python-api.html",
        ):
            page.goto(address + name)
            assert page.evaluate("document.documentElement.scrollWidth") <= 375, name
        page.set_viewport_size({"width": 1280, "height": 800})
        box = page.get_by_role("textbox", name="Search")
        box.fill("backlash")
        box.press("Enter")
        expect(page.locator("#search-results li a").first).to_be_visible()
        before = page.evaluate("document.body.dataset.theme")
        page.locator(".theme-toggle").locator("visible=true").first.click()
        assert page.evaluate("document.body.dataset.theme") != before
        page.close()
    assert complaints == []
