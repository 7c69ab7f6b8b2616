"""`daq docs`: where the documents are, and what it says where they are not."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import pytest

from daq.config import documents
from daq.config.documents import NOT_BUILT
from tests.daq_cli.invoke import CommandLine


@pytest.fixture
def index(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The first page of a site in a folder whose name has a space."""
    site = tmp_path / "built site"
    site.mkdir()
    monkeypatch.setattr(documents, "PLACES", (tmp_path / "nowhere", site))
    return site / "index.html"


def test_it_opens_the_first_page(daq: CommandLine, index: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    index.write_text("<!doctype html>")
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: not opened.append(url))
    assert (daq("docs").code, opened) == (0, [f"file://{str(index).replace(' ', '%20')}"])


def test_it_prints_where_it_is(daq: CommandLine, index: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    index.write_text("<!doctype html>")
    said = daq("docs", "--path")
    assert (said.code, said.out, said.err) == (0, f"{index}\n", "")
    monkeypatch.setattr(webbrowser, "open", lambda _url: False)
    said = daq("docs")
    assert (said.code, said.out) == (0, f"{index}\n")
    assert "no browser was found" in said.err


@pytest.mark.parametrize("words", [("docs",), ("docs", "--path")])
def test_where_it_is_not_built_one_line_says_how_to_build_it(
    daq: CommandLine, index: Path, words: tuple[str, ...]
) -> None:
    assert not index.exists()
    daq(*words).complains(2, NOT_BUILT, "make docs")


def test_it_has_nothing_to_do_with_a_server(daq: CommandLine) -> None:
    daq("--server", "http://127.0.0.1:1", "docs").complains(2, "--server", "daq docs")
