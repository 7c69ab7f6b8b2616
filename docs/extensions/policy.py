"""Makes every page run under a policy that allows no script and no style inside a page.

What the theme and the notebooks write into a page becomes files beside it: a script or a style sheet that is named
after its content, a class for each style attribute. The service can then serve the site as it serves its own page.
"""

from __future__ import annotations

import os
import re
from hashlib import sha256
from pathlib import Path

from sphinx.application import Sphinx

BLOCK = re.compile(r"<(script|style)((?:\s[^>]*)?)>(.*?)</\1>", re.DOTALL)
"""A script or style sheet; up to its end tag, browsers take everything as its content, too."""
TAG = re.compile(r"<[a-zA-Z][\w:-]*(?:\s+[^\s\"'<>/=]+(?:\s*=\s*(?:\"[^\"]*\"|'[^']*'|[^\s\"'=<>`]+))?)*\s*/?>")
STYLE = re.compile(r"\sstyle=(?:\"([^\"]*)\"|'([^']*)')")
CLASS = re.compile(r"(\sclass=[\"'])")
FOLDER, SHEET = "_static/inline", "styles.css"
NOT_RUN = re.compile(r"type=\"(?:application/(?!javascript)|text/(?!javascript))")
"""Types of data that a browser does not run."""


class Files:
    """What the pages of a site wrote into themselves, as files of one folder."""

    def __init__(self, site: Path) -> None:
        self.site = site
        self.folder = site / FOLDER
        self.folder.mkdir(parents=True, exist_ok=True)
        self.sheet = self.folder / SHEET
        # A build writes only pages that have changed: the others were mended before, and keep their classes.
        known = self.sheet.read_text("utf-8").splitlines() if self.sheet.is_file() else []
        self.rules = {line[1:].partition(".")[0]: line.partition("{ ")[2].removesuffix(" }") for line in known}

    def mend(self, page: Path) -> None:
        """Moves what is inside a page out of it."""
        text = page.read_text("utf-8")
        root = os.path.relpath(self.folder, page.parent)

        def block(found: re.Match[str]) -> str:
            kind, attributes, content = found.groups()
            if not content.strip() or NOT_RUN.search(attributes):
                return found[0]
            name = f"{_name(content)}.{'js' if kind == 'script' else 'css'}"
            (self.folder / name).write_text(content, "utf-8")
            if kind == "script":
                return f'<script{attributes} src="{root}/{name}"></script>'
            return f'<link rel="stylesheet" href="{root}/{name}">'

        text = TAG.sub(self._tag, BLOCK.sub(block, text))
        link = f'<link rel="stylesheet" href="{root}/{SHEET}">'
        if link not in text:
            text = text.replace("</head>", f"{link}</head>", 1)
        page.write_text(text, "utf-8")

    def _tag(self, found: re.Match[str]) -> str:
        tag = found[0]
        style = STYLE.search(tag)
        if style is None:
            return tag
        rule = style[1] or style[2] or ""
        name = f"s{_name(rule)}"
        self.rules[name] = " ".join(rule.replace("&quot;", '"').split())
        tag = STYLE.sub("", tag)
        if CLASS.search(tag):
            return CLASS.sub(rf"\1{name} ", tag, count=1)
        return re.sub(r"^(<[a-zA-Z][\w:-]*)", rf'\1 class="{name}"', tag)

    def write_sheet(self) -> None:
        """Writes the classes. A class that is named three times prevails over other rules, as the attribute did."""
        rules = (f".{name}.{name}.{name} {{ {rule} }}\n" for name, rule in sorted(self.rules.items()))
        self.sheet.write_text("".join(rules), "utf-8")


def _name(content: str) -> str:
    return sha256(content.encode()).hexdigest()[:16]


def mend(site: Path) -> None:
    """Moves what is inside the pages of a site out of them."""
    files = Files(site)
    for page in sorted(site.rglob("*.html")):
        files.mend(page)
    files.write_sheet()


def _built(app: Sphinx, error: Exception | None) -> None:
    if error is None and app.builder.format == "html":
        mend(Path(app.outdir))
        for path in Path(app.outdir).rglob("*.map"):
            path.unlink()  # for whoever changes the theme


def setup(app: Sphinx) -> dict[str, bool]:
    """Registers the handler."""
    app.connect("build-finished", _built)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
