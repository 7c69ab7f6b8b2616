"""How the page's files reach a browser."""

import gzip
import json
from pathlib import Path

import httpx
import pytest
from fastapi import FastAPI

import hatch_build
from server.page import FOLDER, NOT_BUILT, Page, is_built
from tests.server.test_site import asked

LATER_ON_LIVE = ("Arm3d", "scene")
"""Parts that the Live page loads by itself once it is there."""
SCRIPT = "assets/index-1a2b.js"
BROTLI = bytes.fromhex("0b04806c6574206c6976653b03")
"""`let live;`, as Node packs it."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A page of three files, as the build leaves them."""
    (tmp_path / "assets").mkdir()
    (tmp_path / "index.html").write_text("<!doctype html>")
    (tmp_path / SCRIPT).write_text("let live;")
    (tmp_path / f"{SCRIPT}.gz").write_bytes(gzip.compress(b"let live;"))
    (tmp_path / f"{SCRIPT}.br").write_bytes(BROTLI)
    (tmp_path / "built-from").write_text("digest")
    return tmp_path


def get(folder: Path, path: str, **headers: str) -> httpx.Response:
    """The answer of a server of the page in `folder`."""
    app = FastAPI(docs_url=None)  # the page has its own
    app.routes.append(Page(folder))
    return asked(app, path, **{name.replace("_", "-"): value for name, value in headers.items()})


def test_the_page_is_asked_for_again_and_its_parts_are_kept_for_ever(folder: Path) -> None:
    page, script = get(folder, "/"), get(folder, f"/{SCRIPT}")
    assert page.headers["content-type"] == "text/html; charset=utf-8"
    assert page.headers["cache-control"] == "no-cache"
    assert "immutable" in script.headers["cache-control"]
    again = get(folder, "/", If_None_Match=page.headers["etag"])
    assert (again.status_code, again.content) == (304, b"")


def test_a_browser_gets_the_smallest_form_that_it_takes(folder: Path) -> None:
    smallest = get(folder, f"/{SCRIPT}", Accept_Encoding="gzip, deflate, br")
    assert smallest.headers["content-encoding"] == "br"
    assert int(smallest.headers["content-length"]) == len(BROTLI)
    packed = get(folder, f"/{SCRIPT}", Accept_Encoding="gzip, br;q=0")
    assert packed.headers["content-encoding"] == "gzip"
    plain = get(folder, f"/{SCRIPT}", Accept_Encoding="identity")
    assert "content-encoding" not in plain.headers
    assert packed.text == plain.text == "let live;"


@pytest.mark.parametrize("name", ["built-from", f"{SCRIPT}.gz", f"{SCRIPT}.br", "nothing.js", "assets"])
def test_nothing_else_is_served(folder: Path, name: str) -> None:
    assert get(folder, f"/{name}").status_code == 404


def test_a_page_that_is_not_built_says_how_to_build_it(tmp_path: Path) -> None:
    for address in ("/", "/api/docs"):
        answer = get(tmp_path, address)
        assert (answer.status_code, answer.text) == (503, NOT_BUILT + "\n")


def test_the_first_load_has_nothing_of_the_reference_of_the_api() -> None:
    index = (FOLDER / "index.html").read_text("utf-8")
    assert "reference" not in index
    assert "reference" in (FOLDER / "reference.html").read_text("utf-8")


def test_the_first_load_is_small() -> None:
    assert is_built(), NOT_BUILT
    index = (FOLDER / "index.html").read_text("utf-8")
    parts = [path for path in (FOLDER / "assets").iterdir() if path.suffix in (".js", ".css")]
    first = [path for path in parts if path.name in index or path.name.startswith(LATER_ON_LIVE)]
    sizes = {path.name: path.with_name(f"{path.name}.br").stat().st_size for path in first}
    assert sum(size for name, size in sizes.items() if not name.startswith(LATER_ON_LIVE)) < 100_000
    sent = sum(sizes.values())
    font = next(FOLDER.glob("assets/inter-latin-wght-normal-*.woff2")).stat().st_size
    assert len(first) >= 4
    assert sent + font < 300_000


def test_the_page_has_the_licence_of_every_package_of_which_it_has_a_part() -> None:
    if not is_built():
        pytest.skip("needs the page: make page")
    notice = (FOLDER / hatch_build.LICENCES).read_text("utf-8")
    wanted = json.loads((hatch_build.DASHBOARD / "package.json").read_text("utf-8"))["dependencies"]
    parts = {part.partition(" ")[0]: part for part in notice.split("\n\n==== ")[1:]}
    assert parts.keys() >= {*wanted, "svelte", "swagger-ui-dist"}
    assert "SIL OPEN FONT LICENSE Version 1.1" in parts["@fontsource-variable/inter"]
    assert "Jed Watson" in parts["swagger-ui-dist"]  # of what that package has in itself
    assert all("Copyright" in part for part in parts.values())
    assert get(FOLDER, f"/{hatch_build.LICENCES}").text == notice


def test_a_package_without_the_text_of_its_licence_ends_the_build(tmp_path: Path) -> None:
    own = tmp_path / "@scope" / "own"
    (own / "dist").mkdir(parents=True)
    (own / "package.json").write_text('{"name": "@scope/own", "version": "1.0.0", "license": "MIT"}')
    with pytest.raises(hatch_build.BuildError, match=r"^@scope/own: its package has no text of its licence"):
        hatch_build.licences_of(["@scope/own/dist/own.js"], tmp_path)
    (own / "LICENCE.md").write_text("Anybody may.")
    made = hatch_build.licences_of(["@scope/own/dist/own.js", "@scope/own/dist/own.css"], tmp_path)
    assert made.endswith("\n\n==== @scope/own 1.0.0 (MIT)\n\nAnybody may.")


def test_what_has_passed_is_judged_again_once_a_file_changes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source = tmp_path / "src" / "page.test.ts"
    for file in (source, tmp_path / "node_modules" / "package.js"):
        file.parent.mkdir()
        file.write_text("as it was")
    run: list[str] = []
    codes = [0, 0, 1, 0]
    monkeypatch.setattr(hatch_build, "DASHBOARD", tmp_path)
    monkeypatch.setattr(hatch_build, "_install", lambda: None)
    monkeypatch.setattr(hatch_build, "node", lambda words, **_: run.append(words[1]) or codes.pop(0))
    for task in ("test", "test", "build"):
        hatch_build.run(task)
    assert run == ["run", "build"]
    source.write_text("changed")
    with pytest.raises(hatch_build.BuildError, match=r"^vitest failed in "):
        hatch_build.run("test")
    hatch_build.run("test")
    assert run == ["run", "build", "run", "run"]
