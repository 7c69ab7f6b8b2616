"""The documentation: the site built by Sphinx (`make docs`) or, without it, pages rendered here from the same Markdown.

Pages rendered here have no search, no notebook output and no pages generated from the code. They need no build and no
further packages: each is rendered when it is requested.
"""

from __future__ import annotations

import html
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from markdown_it.token import Token

_HERE = Path(__file__).parents[2]
PLACES = (_HERE / "docs" / "_site", _HERE / "ma2000" / "docs_site")
"""Folders of the built site: in the source tree, and in an installed package (hatch_build.py)."""
SOURCES = (_HERE, _HERE / "ma2000" / "documents")
"""Roots of the Markdown files: the source tree, and an installed package."""
INDEX = "index.html"
STYLE = Path(__file__).with_name("documents.css")
BROUGHT = {
    "reference/protocol": "firmware_protocol/PROTOCOL.md",
    "reference/changes": "CHANGELOG.md",
    "explanation/contributing": "CONTRIBUTING.md",
}
"""Pages of the site whose source lies elsewhere in the repository."""
PICTURES = {".png": "image/png", ".svg": "image/svg+xml"}
LINK = re.compile(r"(\[[^\]]*)(\]\(<?)([^)\s>]+)(>?\))")
CODE = re.compile(r"(^[ ]*```.*?^[ ]*```)", re.DOTALL | re.MULTILINE)
TREE = re.compile(r"^```{toctree}\n(.*?)^```\n?", re.DOTALL | re.MULTILINE)
HEADER = re.compile(r"\A---\n.*?\n---\n", re.DOTALL)
TITLE = re.compile(r"^# (.+)$", re.MULTILINE)


def site_index() -> Path | None:
    """First page of the built site; None if it is not built."""
    return next((place / INDEX for place in PLACES if (place / INDEX).is_file()), None)


def documents() -> Documents:
    """Returns the pages that are rendered here."""
    return Documents(next((root for root in SOURCES if (root / "docs" / "index.md").is_file()), _HERE))


def brought(docname: str, text: str, root: Path = _HERE) -> str:
    """Returns the text of a page with links relative to `docname` in the site. File names as link texts are removed, so
    that page titles replace them."""
    origin = (root / BROUGHT.get(docname, f"docs/{docname}.md")).parent
    place = (root / "docs" / docname).parent
    home = {(root / path).resolve(): name for name, path in BROUGHT.items()}
    home[(root / "README.md").resolve()] = "index"

    def link(found: re.Match[str]) -> str:
        text, between, whole, end = found.groups()
        target, hash_sign, anchor = whole.partition("#")
        if not target or re.match(r"[a-z][a-z+.-]*:", target):
            return found[0]
        path = (origin / target).resolve()
        if path.is_dir():
            return f"`{path.relative_to(root)}/`" if text.startswith("[`") else text[1:]
        if text == f"[{path.name}":
            text = "["
        if path in home:
            path = root / "docs" / f"{home[path]}.md"
        return f"{text}{between}{os.path.relpath(path, place)}{hash_sign}{anchor}{end}"

    parts = CODE.split(text)
    return "".join(part if number % 2 else LINK.sub(link, part) for number, part in enumerate(parts))


@dataclass(frozen=True)
class Documents:
    """HTML of the pages below a root's folder `docs`."""

    root: Path

    @cached_property
    def folder(self) -> Path:
        """The folder of the pages and their pictures."""
        return (self.root / "docs").resolve()

    def file(self, address: str) -> tuple[bytes, str] | None:
        """Returns content and media type for an address of the site; None if it does not exist."""
        address = address or INDEX
        if address == STYLE.name:
            return STYLE.read_bytes(), "text/css; charset=utf-8"
        try:
            path = (self.folder / address).resolve()
            if not path.is_relative_to(self.folder):
                return None
            if path.suffix in PICTURES and path.is_file():
                return path.read_bytes(), PICTURES[path.suffix]
        except (ValueError, OSError):  # not a possible file name
            return None
        docname = path.relative_to(self.folder).with_suffix("").as_posix()
        if path.suffix != ".html" or docname not in self.names:
            return None
        return self._page(docname).encode(), "text/html; charset=utf-8"

    def write(self, folder: Path) -> Path:
        """Writes the whole site into a folder and returns its first page. Raises OSError."""
        pictures = (path.relative_to(self.folder).as_posix() for path in self.folder.glob("images/*"))
        for address in (STYLE.name, *pictures, *(f"{name}.html" for name in self.names)):
            found = self.file(address)
            if found is not None:
                target = folder / address
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(found[0])
        return folder / INDEX

    @cached_property
    def names(self) -> frozenset[str]:
        """Names of the pages: their paths below the folder, without suffix."""
        paths = (path.relative_to(self.folder) for path in self.folder.rglob("*.md"))
        return frozenset(path.with_suffix("").as_posix() for path in paths if path.parts[0] != "_site")

    def _text(self, docname: str) -> str:
        name = BROUGHT.get(docname, f"docs/{docname}.md")
        path = next((root / name for root in (self.root, _HERE) if (root / name).is_file()), self.root / name)
        return HEADER.sub("", path.read_text("utf-8"))

    def _title(self, docname: str) -> str:
        found = TITLE.search(self._text(docname))
        return found[1].replace("`", "") if found else docname

    def _below(self, docname: str) -> Iterator[str]:
        """Yields the pages in a page's table of contents."""
        for tree in TREE.findall(self._text(docname)):
            for entry in tree.splitlines():
                path = (self.folder / docname).parent / entry
                name = os.path.relpath(path, self.folder)
                if entry and not entry.startswith(":") and name in self.names:
                    yield name

    @cached_property
    def _contents(self) -> tuple[tuple[str, str, tuple[tuple[str, str], ...]], ...]:
        """Returns (name, title, pages below it) of every part of the site."""
        parts = [(name, tuple(self._below(name))) for name in self._below("index")]
        return tuple((name, self._title(name), tuple((p, self._title(p)) for p in pages)) for name, pages in parts)

    def _page(self, docname: str) -> str:
        up = "../" * docname.count("/")

        def entry(name: str, title: str) -> str:
            here = ' aria-current="page"' if name == docname else ""
            return f'<a href="{up}{name}.html"{here}>{html.escape(title)}</a>'

        parts = []
        for name, title, pages in self._contents:
            if not pages:
                parts.append(entry(name, title))
                continue
            inside = "".join(f"<li>{entry(*page)}</li>" for page in pages)
            is_open = " open" if docname == name or docname in dict(pages) else ""
            parts.append(
                f"<details{is_open}><summary>{html.escape(title)}</summary><ul><li>{entry(name, title)}</li>{inside}"
                "</ul></details>"
            )
        return (
            '<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width, initial-scale=1">'
            f"<title>{html.escape(self._title(docname))} · MA2000 DAQ</title>"
            f'<link rel="stylesheet" href="{up}{STYLE.name}"></head><body>'
            f'<nav aria-label="Documents">{entry("index", "MA2000 DAQ")}{"".join(parts)}</nav>'
            f"<main>{self._body(docname)}</main></body></html>"
        )

    def _body(self, docname: str) -> str:
        from markdown_it import MarkdownIt

        text = TREE.sub("", brought(docname, self._text(docname), self.root))
        text = re.sub(r"^```{code-cell}.*$", "```python", text, flags=re.MULTILINE)
        parser = MarkdownIt("commonmark", {"html": True}).enable("table")
        tokens = parser.parse(text)
        taken: set[str] = set()
        for place, token in enumerate(tokens):
            if token.type == "heading_open":
                token.attrSet("id", _anchor(tokens[place + 1], taken))
            if style := token.attrGet("style"):  # the service's policy forbids inline styles
                del token.attrs["style"]
                token.attrSet("class", str(style).rpartition(":")[2])
            for child in _links(token):
                self._lead(child, docname)
        for token in tokens:
            if token.children:
                self._name_links(token.children, docname)
        return str(parser.renderer.render(tokens, parser.options, {}))

    def _lead(self, link: Token, docname: str) -> None:
        """Points a link to its page or picture; a link outside the site loses its target."""
        target, hash_sign, anchor = str(link.attrGet("href") or "").partition("#")
        if not target or re.match(r"[a-z][a-z+.-]*:", target):
            return
        name = os.path.relpath((self.folder / docname).parent / target, self.folder)
        if name.endswith(".md") and name.removesuffix(".md") in self.names:
            link.attrSet("href", f"{target.removesuffix('.md')}.html{hash_sign}{anchor}")
        elif not (name.startswith("images/") and (self.folder / name).is_file()):
            link.type, link.tag = "span_open", "span"
            link.attrs.clear()
            link.attrSet("title", f"in the source tree: docs/{name}" if not name.startswith("..") else name[3:])

    def _name_links(self, children: list[Token], docname: str) -> None:
        """Closes links without target, and gives a link without text the title of its page."""
        open_links: list[Token] = []
        for place in range(len(children) - 1, -1, -1):
            token = children[place]
            if token.type == "link_close":
                open_links.append(token)
            elif token.type in ("link_open", "span_open") and open_links:
                close = open_links.pop()
                if token.type == "span_open":
                    close.type, close.tag = "span_close", "span"
                elif children[place + 1] is close:
                    children.insert(place + 1, self._title_of(token, docname))

    def _title_of(self, link: Token, docname: str) -> Token:
        from markdown_it.token import Token

        target, _, anchor = str(link.attrGet("href")).partition("#")
        name = os.path.relpath((self.folder / docname).parent / target.removesuffix(".html"), self.folder)
        title = self._title(name) if name in self.names else target
        return Token("text", "", 0, content=f"{title}: {anchor.replace('-', ' ')}" if anchor else title)


def _links(token: Token) -> list[Token]:
    return [child for child in token.children or () if child.type == "link_open"]


def _anchor(heading: Token, taken: set[str]) -> str:
    """Anchor of a heading as in GitHub and MyST: lower case, dashes for spaces, no other punctuation, unique."""
    text = "".join(child.content for child in heading.children or ())
    first = re.sub(r"[^\w\- ]", "", text.lower()).replace(" ", "-")
    anchor, number = first, 0
    while anchor in taken:
        number += 1
        anchor = f"{first}-{number}"
    taken.add(anchor)
    return anchor
