"""`daq docs`: where the documents are, built or made at once."""

import webbrowser
from pathlib import Path

import pytest

from daq.config import documents
from tests.daq_cli.invoke import CommandLine


@pytest.fixture
def index(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The first page of a site in a folder whose name has a space."""
    site = tmp_path / "built site"
    site.mkdir()
    monkeypatch.setattr(documents, "PLACES", (tmp_path / "nowhere", site))
    return site / "index.html"


def test_it_opens_the_first_page_or_prints_where_it_is(
    daq: CommandLine, index: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    index.write_text("<!doctype html>")
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: not opened.append(url))
    assert (daq("docs").code, opened) == (0, [f"file://{str(index).replace(' ', '%20')}"])
    said = daq("docs", "--path")
    assert (said.code, said.out, said.err) == (0, f"{index}\n", "")
    monkeypatch.setattr(webbrowser, "open", lambda _url: False)
    said = daq("docs")
    assert (said.code, said.out) == (0, f"{index}\n")
    assert "no browser was found" in said.err


def test_where_it_is_not_built_the_pages_are_written_where_this_user_may(
    daq: CommandLine, index: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert not index.exists()
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    first = Path(daq("docs", "--path").out.strip())
    assert first.is_relative_to(tmp_path / "cache")
    assert "<h1" in first.read_text("utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", "/proc/nonexistent")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert Path(daq("docs", "--path").out.strip()).is_relative_to(tmp_path)


def test_it_has_nothing_to_do_with_a_server(daq: CommandLine) -> None:
    daq("--server", "http://127.0.0.1:1", "docs").complains(2, "--server", "daq docs")
